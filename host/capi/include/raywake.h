/* raywake: temporal scene flow from LIDAR, a sweep at a time, on the CPU.
 *
 *     raywake_options options = {.abi_version = RAYWAKE_ABI_VERSION, .ground_m = -1.73};
 *     size_t bytes;
 *     raywake_memory_needed(&options, &bytes, NULL);
 *     raywake_estimator *estimator;
 *     raywake_create(&options, malloc(bytes), bytes, &estimator, NULL);
 *     for (each sweep) {
 *         raywake_step(estimator, &sweep, &result, NULL);
 *         raywake_points(estimator, points, room, NULL);    of the sweep before
 *     }
 *     raywake_destroy(estimator);
 *
 * Frames: x forward, y left, z up; the world is the frame of the poses. Nothing is allocated after
 * raywake_create. An estimator may be used from any thread, by one at a time; several estimators
 * are independent of each other. After fork() it is of use in the parent alone. Where no threads are
 * wanted, that which calls needs 512 KiB of stack.
 *
 * Made by cbindgen of host/capi: change it there. */


#ifndef RAYWAKE_H
#define RAYWAKE_H

#include <stddef.h>
#include <stdint.h>

// Version of this interface: structs, functions and their meaning. Another number is another
// interface; the shared library is named after it.
#define RAYWAKE_ABI_VERSION 2

// All returns are taken at the sweep's stamp.
#define RAYWAKE_TIMING_AT_STAMP 0

// Every return comes with its time after the stamp.
#define RAYWAKE_TIMING_OFFSET 1

// The azimuth tells the time: the sensor spins clockwise seen from above, starts and ends at the
// rear, and is stamped when it looks forward (KITTI's HDL-64E).
#define RAYWAKE_TIMING_AZIMUTH 2

// Sensors that a rig may have.
#define RAYWAKE_SENSORS_MAX 8

// Where a digest begins.
#define RAYWAKE_DIGEST_START 14695981039346656037ull

// Objects that there are at most.
#define RAYWAKE_OBJECTS_MAX 160

// It continues the one before.
#define RAYWAKE_RESET_NONE 0

// It is the first one.
#define RAYWAKE_RESET_FIRST 1

// Time stood still or went backwards.
#define RAYWAKE_RESET_BACKWARDS 2

// Too much time has passed.
#define RAYWAKE_RESET_GAP 3

// The vehicle cannot have gone there so fast.
#define RAYWAKE_RESET_JUMP 4

// The vehicle cannot have turned so fast.
#define RAYWAKE_RESET_SPIN 5

// The pose was given.
#define RAYWAKE_POSE_GIVEN 0

// Of the first sweep.
#define RAYWAKE_POSE_START 1

// By registration.
#define RAYWAKE_POSE_REGISTERED 2

// The sweep shows too little: a part of the motion is that of the sweep before.
#define RAYWAKE_POSE_DEGENERATE 3

// The sweep fits nothing known: its motion is that of the sweep before.
#define RAYWAKE_POSE_LOST 4

// Class of a column or return: there is none.
#define RAYWAKE_NO_CLASS 255

// How a call ended.
typedef enum {
    // Well.
    RAYWAKE_STATUS_OK = 0,
    // A pointer is null that must not be.
    RAYWAKE_STATUS_NULL_POINTER = 1,
    // An argument is not what it must be.
    RAYWAKE_STATUS_INVALID_ARGUMENT = 2,
    // The program was compiled with a header of another ABI.
    RAYWAKE_STATUS_OTHER_ABI = 3,
    // The memory given is smaller than `raywake_memory_needed` says.
    RAYWAKE_STATUS_MEMORY_TOO_SMALL = 4,
    // The system has no more threads.
    RAYWAKE_STATUS_NO_THREADS = 5,
    // There is no estimator at this address: it was not created, or was destroyed.
    RAYWAKE_STATUS_NOT_CREATED = 6,
    // Another thread is in a call with this estimator.
    RAYWAKE_STATUS_BUSY = 7,
    // A defect of the library ended a sweep early; the estimator can only be destroyed.
    RAYWAKE_STATUS_FAILED = 8,
} raywake_status;

// An estimator in the caller's memory.
typedef struct raywake_estimator raywake_estimator;

// A rigid transform `target_from_source`.
typedef struct {
    // Origin of the source frame in the target frame, m.
    double translation[3];
    // Unit quaternion x, y, z, w.
    double rotation[4];
} raywake_pose;

// What an estimator is to be made for. What is zero has its default.
typedef struct {
    // `RAYWAKE_ABI_VERSION`.
    uint32_t abi_version;
    // Threads that share the work; 0: as many as pay, 1: only that which calls.
    uint32_t threads;
    // Name of a profile: `hdl64` (the default), `wide`, `far` or `dissertation`.
    const char *profile;
    // Parameters to be set, `NAME=VALUE` each, as PARAMETERS.md has them.
    const char *const *settings;
    // How many.
    size_t settings_count;
    // Returns that a sweep may have; 0: as many as the profile takes. Of a sweep that has more
    // than the profile takes, so many are taken, evenly.
    size_t points_max;
    // Not 0: no poses are given, they are found by registration.
    uint32_t find_poses;
    // `RAYWAKE_TIMING_...`.
    uint32_t timing;
    // Not 0: objects are followed, too, in memory of their own.
    uint32_t objects;
    // `RAYWAKE_TIMING_OFFSET`: earliest time of a return after the stamp, s.
    double from_s;
    // Duration of a sweep, s; 0.1 where it is 0.
    double span_s;
    // Not 0: returns are still distorted by the vehicle's motion. Each is moved to the stamp by
    // its time.
    uint32_t distorted;
    // Sensors; 0: one at the vehicle's origin.
    uint32_t sensor_count;
    // `vehicle_from_sensor` of each: rays begin there.
    raywake_pose sensors[RAYWAKE_SENSORS_MAX];
    // Height of the ground under the vehicle in the vehicle frame, m. With the vehicle's origin
    // 1.73 m above the ground it is -1.73.
    double ground_m;
    // Returns in this box of the vehicle frame are of the vehicle itself: least x and y, largest x
    // and y, m. All 0: there are none.
    float own_vehicle_m[4];
} raywake_options;

// Room for a text that says what was wrong.
typedef struct {
    // UTF-8 with a NUL at its end; empty where nothing was wrong.
    char text[240];
} raywake_error;

// Flow of one solid column of a pair's first sweep.
typedef struct {
    // Centre in the world (the frame of the poses), m.
    double position_world_m[2];
    // Index in the lattice, whose cell (0, 0) lies at the vehicle in the first sweep.
    int32_t cell[2];
    // Centre in the vehicle frame, m.
    float position_vehicle_m[2];
    // Displacement over ground until the second sweep, along world axes, m.
    float displacement_m[2];
    // Its covariance (xx, xy, yy), m^2.
    float displacement_covariance[3];
    // Velocity over ground along world axes, m/s.
    float velocity_world_mps[2];
    // Velocity relative to the vehicle along vehicle axes, m/s.
    float velocity_ego_mps[2];
    // Covariance of the velocity over ground (xx, xy, yy), (m/s)^2.
    float velocity_covariance[3];
    // P(moves).
    float probability;
    // Observations of its tracklet after birth.
    uint32_t age;
    // Whence the flow: 0 background, 1 unmatched, 2 matched, 3 joined (with its cluster).
    uint8_t basis;
    // 0 ground, 1 structure, 2 vegetation, 3 pole, 4 car, 5 large vehicle, 6 person,
    // 7 two-wheeler; 255: none.
    uint8_t class_id;
    // 0.
    uint8_t reserved[6];
} raywake_column;

// Flow of one return of a pair's first sweep.
typedef struct {
    // Velocity over ground along world axes, m/s.
    float velocity_world_mps[2];
    // Velocity relative to the vehicle along vehicle axes, m/s.
    float velocity_ego_mps[3];
    // Covariance of the velocity over ground (xx, xy, yy), (m/s)^2.
    float velocity_covariance[3];
    // P(moves).
    float probability;
    // Observations of its column's tracklet after birth.
    uint32_t age;
    // What became of it: 0 static, 1 moving, 2 unmatched, 3 outside the window, 4 over capacity,
    // 5 own vehicle, 6 no echo, 7 invalid.
    uint8_t status;
    // As of a column.
    uint8_t basis;
    // As of a column.
    uint8_t class_id;
    // 0.
    uint8_t reserved;
} raywake_point;

// A flow tracklet, at the time of the last sweep.
typedef struct {
    // Position in the world, m.
    double position_world_m[2];
    // Lattice cell it lies in.
    int32_t cell[2];
    // Position in the vehicle frame, m.
    float position_vehicle_m[2];
    // Heading of its motion in the world, rad.
    float heading_rad;
    // Speed over ground along the heading, m/s.
    float speed_mps;
    // Turning rate, rad/s.
    float turn_rate_radps;
    // P(moves), as last observed.
    float probability;
    // Velocity over ground along world axes, m/s.
    float velocity_world_mps[2];
    // Velocity relative to the vehicle along vehicle axes, m/s.
    float velocity_ego_mps[2];
    // Covariance of x, y, heading, speed and turning rate, row by row.
    float covariance[25];
    // Observations after birth.
    uint32_t age;
} raywake_tracklet;

// An object in a pair's first sweep: a box with a velocity.
typedef struct {
    // When it was last seen, s: before the sweep's stamp where it was not seen in it.
    double time_s;
    // Middle of its box in the world (the frame of the poses), m.
    double position_world_m[3];
    // Direction of its length in the world, rad. Of what stands either end may be the front.
    float heading_rad;
    // Length, width and height of what was seen of it, m.
    float size_m[3];
    // Velocity over ground along world axes, m/s; 0 where it stands.
    float velocity_world_mps[2];
    // Turning rate, rad/s.
    float turn_rate_radps;
    // Covariance of its place (xx, xy, yy) and variance of its height, m^2.
    float position_covariance[4];
    // Variance of the heading, rad^2.
    float heading_variance;
    // Variance of the speed, (m/s)^2.
    float speed_variance;
    // Variance of the turning rate, (rad/s)^2.
    float turn_rate_variance;
    // P(moves), the mean of its returns; NaN where it is not known.
    float probability;
    // The share of its returns that are taken for what it is taken for, 0 to 1.
    float class_share;
    // Number of its track, from 0 in the order of their births.
    uint32_t id;
    // Times that it was seen.
    uint32_t observations;
    // 1: it moves; 0: it stands.
    uint8_t moves;
    // As of a column; what most of its returns are taken for.
    uint8_t class_id;
    // 0.
    uint8_t reserved[6];
} raywake_object;

// Velocity of the vehicle, along its own axes.
typedef struct {
    // m/s.
    double linear[3];
    // Axis times rate, rad/s.
    double angular[3];
} raywake_twist;

// One sweep. Numbers of returns may lie anywhere, `..._stride` bytes apart, as the fields of a
// `PointCloud2` do; the sweep is copied.
typedef struct {
    // Time of the stamp, s.
    double stamp_s;
    // Pose of the vehicle at the stamp; null where poses are found.
    const raywake_pose *world_from_vehicle;
    // Its velocity at the stamp; null: what leads from the pose before to this one.
    const raywake_twist *twist;
    // Returns.
    size_t count;
    // Three `float` each: x, y, z in the vehicle frame, m. (0, 0, 0) is no return.
    const void *xyz;
    // Bytes from one to the next; 0: 12.
    size_t xyz_stride;
    // A `float` each: time after the stamp, s; null: 0.
    const void *time_s;
    // Bytes from one to the next; 0: 4.
    size_t time_stride;
    // A byte each: index of the sensor; null: 0.
    const void *sensor;
    // Bytes from one to the next; 0: 1.
    size_t sensor_stride;
} raywake_sweep;

// What a sweep came to.
typedef struct {
    // Time from the sweep before to this one, s; 0 where they are no pair: then there is no flow.
    double dt_s;
    // Solid columns of the sweep before, whose flow can be read.
    size_t columns;
    // Returns of the sweep before, whose flow can be read.
    size_t points;
    // Tracklets that can be read.
    size_t tracklets;
    // Objects in the sweep before that can be read.
    size_t objects;
    // Columns with a valid match.
    size_t matched;
    // Foreground columns of the sweep.
    size_t foreground;
    // Foreground columns beyond the capacity.
    size_t foreground_dropped;
    // Distinct rays of the sweep.
    size_t rays;
    // Returns left out, as the sweep has more than the profile takes.
    uint64_t over_capacity;
    // Returns left out that have a NaN or an infinity.
    uint64_t not_finite;
    // Returns left out at (0, 0, 0).
    uint64_t no_return;
    // Returns left out that are too far away.
    uint64_t too_far;
    // Returns left out of a sensor that the rig does not have.
    uint64_t unknown_sensor;
    // Returns of the own vehicle.
    uint64_t own_vehicle;
    // Returns that the refinement had no room for.
    uint64_t unrefined;
    // `RAYWAKE_RESET_...`: why the sweep does not continue the one before.
    uint32_t reset;
    // `RAYWAKE_POSE_...`: where its pose is from.
    uint32_t pose_from;
    // Pose of the vehicle at the stamp.
    raywake_pose world_from_vehicle;
} raywake_result;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// `RAYWAKE_ABI_VERSION` of the library that is loaded.
uint32_t raywake_abi_version(void);

// Version of the library, a text.
const char *raywake_version(void);

// Bytes of memory that `raywake_create` needs, wherever they begin.
//
// # Safety
// Pointers are null or to what they are of; texts end in NUL.
raywake_status raywake_memory_needed(const raywake_options *options,
                                     size_t *bytes,
                                     raywake_error *error);

// Makes an estimator in the caller's memory, which is the library's until `raywake_destroy`.
//
// Threads are started here, and what they need is taken from the heap; later nothing is.
//
// # Safety
// Pointers are null or to what they are of; texts end in NUL; `memory` has `bytes` bytes that
// nobody else uses until the estimator is destroyed.
raywake_status raywake_create(const raywake_options *options,
                              void *memory,
                              size_t bytes,
                              raywake_estimator **estimator,
                              raywake_error *error);

// Ends an estimator and its threads. Its memory is the caller's again.
//
// # Safety
// `estimator` is null, or was one once, and its memory is still there.
raywake_status raywake_destroy(raywake_estimator *estimator);

// Flow of the solid columns of the sweep before the last: the first `room` of them to `records`,
// which may be null where that is 0; to `count`, which may be null, how many there are.
//
// # Safety
// Pointers are null or to what they are of; `estimator` is null, or was one once, and its memory
// is still there.
raywake_status raywake_columns(raywake_estimator *estimator,
                               raywake_column *records,
                               size_t room,
                               size_t *count);

// Flow of the returns of the sweep before the last, in their order. As `raywake_columns`.
//
// # Safety
// As of `raywake_columns`.
raywake_status raywake_points(raywake_estimator *estimator,
                              raywake_point *records,
                              size_t room,
                              size_t *count);

// Tracklets at the time of the last sweep. As `raywake_columns`.
//
// # Safety
// As of `raywake_columns`.
raywake_status raywake_tracklets(raywake_estimator *estimator,
                                 raywake_tracklet *records,
                                 size_t room,
                                 size_t *count);

// Objects in the sweep before the last, where the options ask for them: vehicles, people and
// two-wheelers, and whatever else moves. As `raywake_columns`.
//
// # Safety
// As of `raywake_columns`.
raywake_status raywake_objects(raywake_estimator *estimator,
                               raywake_object *records,
                               size_t room,
                               size_t *count);

// Adds all that can be read but objects to a digest, which begins as `RAYWAKE_DIGEST_START`. After
// every sweep of a recording it is the digest that the program `raywake` prints.
//
// # Safety
// As of `raywake_columns`.
raywake_status raywake_add_to_digest(raywake_estimator *estimator, uint64_t *digest);

// What a status means, a text.
const char *raywake_status_text(int32_t status);

// One sweep. The flow of the one before can be read until the next call of this function.
//
// A sweep that is refused is as if it had not been given.
//
// # Safety
// Pointers are null or to what they are of, with `count` elements; `estimator` is null, or was
// one once, and its memory is still there.
raywake_status raywake_step(raywake_estimator *estimator,
                            const raywake_sweep *sweep,
                            raywake_result *result,
                            raywake_error *error);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* RAYWAKE_H */
