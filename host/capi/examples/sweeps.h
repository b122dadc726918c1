/* Reads files written by dump_sweeps, which describes their format. */
#include <raywake.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

/* A return as stored in the file. */
typedef struct {
    float xyz[3];
    float time_s;
    uint32_t sensor;
} file_point;

static int take(FILE *file, void *to, size_t bytes) { return fread(to, 1, bytes, file) == bytes; }

static void need(FILE *file, void *to, size_t bytes) {
    if (!take(file, to, bytes)) {
        fprintf(stderr, "the file ends too early\n");
        exit(3);
    }
}

/* A sweep of the file, and what it points to; zeros before the first. */
typedef struct {
    raywake_sweep sweep;
    raywake_pose pose;
    raywake_twist twist;
    file_point *points;
    size_t room;
} file_sweep;

/* Reads the next sweep; 0 at the end of the file. */
static int next_sweep(FILE *file, file_sweep *to) {
    uint64_t count = 0;
    if (!take(file, &to->sweep.stamp_s, 8)) return 0;
    need(file, &to->pose, sizeof to->pose);
    need(file, &to->twist, sizeof to->twist);
    need(file, &count, 8);
    if (count > to->room || !to->points) {
        free(to->points);
        to->room = count;
        to->points = malloc((count ? count : 1) * sizeof *to->points);
        if (!to->points) exit(6);
    }
    file_point *points = to->points;
    need(file, points, count * sizeof *points);
    to->sweep = (raywake_sweep){.stamp_s = to->sweep.stamp_s,
                                .world_from_vehicle = &to->pose,
                                .twist = &to->twist,
                                .count = count,
                                .xyz = points->xyz,
                                .time_s = &points->time_s,
                                .sensor = &points->sensor, /* the low byte */
                                .xyz_stride = sizeof *points,
                                .time_stride = sizeof *points,
                                .sensor_stride = sizeof *points};
    return 1;
}

/* Reads the rig at the start of the file. */
static raywake_options rig_of(FILE *file) {
    raywake_options options = {.abi_version = RAYWAKE_ABI_VERSION};
    uint64_t sensors = 0;
    need(file, &options.timing, 4);
    need(file, &options.distorted, 4);
    need(file, &options.from_s, 8);
    need(file, &options.span_s, 8);
    need(file, &options.ground_m, 8);
    need(file, options.own_vehicle_m, sizeof options.own_vehicle_m);
    need(file, &sensors, 8);
    if (sensors > RAYWAKE_SENSORS_MAX) {
        fprintf(stderr, "%llu sensors are too many\n", (unsigned long long)sensors);
        exit(3);
    }
    options.sensor_count = (uint32_t)sensors;
    need(file, options.sensors, sensors * sizeof options.sensors[0]);
    return options;
}
