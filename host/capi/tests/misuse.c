/* Invalid calls: each must return its status, and none may crash. Then drives, in which nothing may
 * be allocated. `misuse FILE` reads a file written by `dump_sweeps`. */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <pthread.h>
#include <raywake.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "../examples/sweeps.h"

#ifdef COUNT_ALLOCATIONS
/* Replaces libc's allocator: counts what the whole process asks for. */
extern void *__libc_malloc(size_t);
extern void *__libc_calloc(size_t, size_t);
extern void *__libc_realloc(void *, size_t);
extern void *__libc_memalign(size_t, size_t);
static atomic_long allocations;
static void *counted(void *at) {
    allocations++;
    return at;
}
void *malloc(size_t bytes) { return counted(__libc_malloc(bytes)); }
void *calloc(size_t n, size_t bytes) { return counted(__libc_calloc(n, bytes)); }
void *realloc(void *at, size_t bytes) { return counted(__libc_realloc(at, bytes)); }
void *aligned_alloc(size_t to, size_t bytes) { return counted(__libc_memalign(to, bytes)); }
void *memalign(size_t to, size_t bytes) { return counted(__libc_memalign(to, bytes)); }
int posix_memalign(void **at, size_t to, size_t bytes) {
    *at = counted(__libc_memalign(to, bytes));
    return *at ? 0 : 12;
}
static long allocated(void) { return allocations; }
#else
static long allocated(void) { return 0; }
#endif

static int failed;

static void expect(int line, raywake_status found, raywake_status wanted) {
    if (found != wanted) {
        printf("line %d: %s, not: %s\n", line, raywake_status_text(found),
               raywake_status_text(wanted));
        failed = 1;
    }
}
#define EXPECT(call, status) expect(__LINE__, call, RAYWAKE_STATUS_##status)
#define CHECK(what) \
    do { \
        if (!(what)) printf("line %d: %s\n", __LINE__, #what), failed = 1; \
    } while (0)

static raywake_options options(void) {
    raywake_options o = {.abi_version = RAYWAKE_ABI_VERSION, .ground_m = -1.73, .threads = 1,
                         .objects = 1};
    return o;
}

static void options_that_are_none(void) {
    raywake_error error;
    size_t bytes = 0;
    raywake_options o = options();
    EXPECT(raywake_memory_needed(NULL, &bytes, &error), NULL_POINTER);
    EXPECT(raywake_memory_needed(&o, NULL, NULL), NULL_POINTER);
    o.abi_version = RAYWAKE_ABI_VERSION + 1;
    EXPECT(raywake_memory_needed(&o, &bytes, &error), OTHER_ABI);
    o = options(), o.profile = "hdl65";
    EXPECT(raywake_memory_needed(&o, &bytes, &error), INVALID_ARGUMENT);
    CHECK(strstr(error.text, "hdl65"));
    o = options(), o.profile = "\xff\xfe";
    EXPECT(raywake_memory_needed(&o, &bytes, &error), INVALID_ARGUMENT);
    char name[2000];
    memset(name, 'x', sizeof name), name[1999] = 0;
    o.profile = name;
    EXPECT(raywake_memory_needed(&o, &bytes, &error), INVALID_ARGUMENT);
    CHECK(strlen(error.text) == sizeof error.text - 1);
    const char *settings[] = {"side=100", "sied=3", "side", "levels=12", "returns_max=1e9", NULL};
    for (int n = 0; n < 6; n++) {
        o = options(), o.settings = settings + n, o.settings_count = 1;
        raywake_status status = raywake_memory_needed(&o, &bytes, &error);
        /* Weights for other levels are noticed when they are read. */
        raywake_status wanted = n == 3   ? RAYWAKE_STATUS_OK
                                : n == 5 ? RAYWAKE_STATUS_NULL_POINTER
                                         : RAYWAKE_STATUS_INVALID_ARGUMENT;
        expect(__LINE__, status, wanted);
    }
    o = options(), o.settings_count = 1;
    EXPECT(raywake_memory_needed(&o, &bytes, &error), NULL_POINTER);
    o = options(), o.sensor_count = RAYWAKE_SENSORS_MAX + 1;
    EXPECT(raywake_memory_needed(&o, &bytes, &error), INVALID_ARGUMENT);
    o = options(), o.sensor_count = 1; /* a rotation of zeros */
    EXPECT(raywake_memory_needed(&o, &bytes, &error), INVALID_ARGUMENT);
    o = options(), o.timing = 3;
    EXPECT(raywake_memory_needed(&o, &bytes, &error), INVALID_ARGUMENT);
    o = options(), o.timing = RAYWAKE_TIMING_OFFSET, o.span_s = -1;
    EXPECT(raywake_memory_needed(&o, &bytes, &error), INVALID_ARGUMENT);
    o = options(), o.ground_m = NAN;
    EXPECT(raywake_memory_needed(&o, &bytes, &error), INVALID_ARGUMENT);
    o = options(), o.ground_m = -1e16;
    EXPECT(raywake_memory_needed(&o, &bytes, &error), INVALID_ARGUMENT);
    o = options(), o.points_max = SIZE_MAX;
    EXPECT(raywake_memory_needed(&o, &bytes, &error), MEMORY_TOO_SMALL);
    o = options();
    EXPECT(raywake_memory_needed(&o, &bytes, &error), OK);
    CHECK(error.text[0] == 0 && bytes > 1000000);
}

static void addresses_that_are_none(void) {
    raywake_options o = options();
    size_t bytes = 0, count;
    raywake_error error;
    raywake_result result;
    raywake_sweep sweep = {0};
    uint64_t digest = 0;
    EXPECT(raywake_memory_needed(&o, &bytes, NULL), OK);
    void *memory = malloc(bytes);
    raywake_estimator *e = NULL;
    EXPECT(raywake_create(NULL, memory, bytes, &e, &error), NULL_POINTER);
    EXPECT(raywake_create(&o, NULL, bytes, &e, &error), NULL_POINTER);
    EXPECT(raywake_create(&o, memory, bytes, NULL, &error), NULL_POINTER);
    EXPECT(raywake_create(&o, memory, bytes - 1, &e, &error), MEMORY_TOO_SMALL);
    EXPECT(raywake_create(&o, memory, 0, &e, &error), MEMORY_TOO_SMALL);
    const char *levels[] = {"levels=12"};
    raywake_options low = o;
    low.settings = levels, low.settings_count = 1;
    EXPECT(raywake_create(&low, memory, bytes, &e, &error), INVALID_ARGUMENT);
    CHECK(strstr(error.text, "weights"));
    memset(memory, 0x55, 4096);
    raywake_estimator *nowhere[] = {NULL, memory, (void *)((char *)memory + 1)};
    for (int n = 0; n < 3; n++) {
        raywake_status wanted = n ? RAYWAKE_STATUS_NOT_CREATED : RAYWAKE_STATUS_NULL_POINTER;
        expect(__LINE__, raywake_step(nowhere[n], &sweep, &result, &error), wanted);
        expect(__LINE__, raywake_columns(nowhere[n], NULL, 0, &count), wanted);
        expect(__LINE__, raywake_objects(nowhere[n], NULL, 0, &count), wanted);
        expect(__LINE__, raywake_add_to_digest(nowhere[n], &digest), wanted);
        expect(__LINE__, raywake_destroy(nowhere[n]), wanted);
    }
    EXPECT(raywake_create(&o, memory, bytes, &e, &error), OK);
    /* Before any sweep there is nothing to read. */
    count = 9;
    EXPECT(raywake_points(e, NULL, 0, &count), OK);
    CHECK(count == 0);
    EXPECT(raywake_columns(e, NULL, 1, &count), NULL_POINTER);
    EXPECT(raywake_tracklets(e, NULL, 0, NULL), OK);
    EXPECT(raywake_objects(e, NULL, 0, &count), OK);
    CHECK(count == 0);
    EXPECT(raywake_add_to_digest(e, NULL), NULL_POINTER);
    EXPECT(raywake_step(e, NULL, &result, &error), NULL_POINTER);
    EXPECT(raywake_destroy(e), OK);
    EXPECT(raywake_destroy(e), NOT_CREATED);
    EXPECT(raywake_step(e, &sweep, &result, &error), NOT_CREATED);
    free(memory);
}

static void sweeps_that_are_none(void) {
    raywake_options o = options();
    o.points_max = 4;
    size_t bytes = 0;
    raywake_estimator *e = NULL;
    raywake_error error;
    raywake_result result;
    EXPECT(raywake_memory_needed(&o, &bytes, NULL), OK);
    void *memory = malloc(bytes);
    EXPECT(raywake_create(&o, memory, bytes, &e, &error), OK);
    float xyz[15] = {5, 0, 0, NAN, 0, 0, 0, 0, 0, INFINITY};
    raywake_pose pose = {.rotation = {0, 0, 0, 1}};
    raywake_twist twist = {.linear = {1}};
    raywake_sweep good = {
        .stamp_s = 1, .world_from_vehicle = &pose, .twist = &twist, .count = 4, .xyz = xyz};
    raywake_sweep s = good;
    s.stamp_s = NAN;
    EXPECT(raywake_step(e, &s, &result, &error), INVALID_ARGUMENT);
    raywake_pose away = pose;
    away.translation[1] = 1e18;
    s = good, s.world_from_vehicle = &away;
    EXPECT(raywake_step(e, &s, &result, &error), INVALID_ARGUMENT);
    s = good, s.world_from_vehicle = NULL;
    EXPECT(raywake_step(e, &s, &result, &error), INVALID_ARGUMENT);
    s = good, s.count = 5;
    EXPECT(raywake_step(e, &s, &result, &error), INVALID_ARGUMENT);
    s = good, s.count = SIZE_MAX;
    EXPECT(raywake_step(e, &s, &result, &error), INVALID_ARGUMENT);
    s = good, s.xyz = NULL;
    EXPECT(raywake_step(e, &s, &result, &error), NULL_POINTER);
    s = good, s.xyz_stride = 11;
    EXPECT(raywake_step(e, &s, &result, &error), INVALID_ARGUMENT);
    s = good, s.xyz_stride = SIZE_MAX / 2;
    EXPECT(raywake_step(e, &s, &result, &error), INVALID_ARGUMENT);
    s = good, s.time_s = xyz, s.time_stride = 3;
    EXPECT(raywake_step(e, &s, &result, &error), INVALID_ARGUMENT);
    raywake_pose bad = pose;
    bad.rotation[3] = 1.1;
    s = good, s.world_from_vehicle = &bad;
    EXPECT(raywake_step(e, &s, &result, &error), INVALID_ARGUMENT);
    CHECK(strstr(error.text, "unit"));
    bad = pose, bad.translation[1] = -INFINITY;
    EXPECT(raywake_step(e, &s, &result, &error), INVALID_ARGUMENT);
    raywake_twist wild = {.angular = {NAN}};
    s = good, s.twist = &wild;
    EXPECT(raywake_step(e, &s, &result, &error), INVALID_ARGUMENT);
    /* None of them was accepted. */
    EXPECT(raywake_step(e, &good, &result, NULL), OK);
    CHECK(result.reset == RAYWAKE_RESET_FIRST && result.not_finite == 2 && result.no_return == 1);
    s = good, s.stamp_s = 1.1, s.count = 0, s.xyz = NULL;
    EXPECT(raywake_step(e, &s, &result, NULL), OK);
    EXPECT(raywake_destroy(e), OK);
    free(memory);
}

/* Calls from two threads at once. */
static raywake_estimator *shared;
static atomic_int stop, busy;

static void *disturb(void *nothing) {
    uint64_t digest = 0;
    while (!stop) {
        raywake_status status = raywake_add_to_digest(shared, &digest);
        busy += status == RAYWAKE_STATUS_BUSY;
        CHECK(status == RAYWAKE_STATUS_BUSY || status == RAYWAKE_STATUS_OK);
        nanosleep(&(struct timespec){.tv_nsec = 100000}, NULL);
    }
    return nothing;
}

/* A drive with two threads, whose results are read. With `disturbed`, a third thread reads all the
   while instead; with `all`, one thread, poses found and objects tracked. Returns its digest. */
static uint64_t drive(const char *path, int disturbed, int all) {
    FILE *file = fopen(path, "rb");
    if (!file) exit(3);
    raywake_options o = rig_of(file);
    o.threads = all ? 1 : 2, o.find_poses = o.objects = all;
    uint64_t digest = RAYWAKE_DIGEST_START;
    size_t bytes = 0, room = 262144;
    EXPECT(raywake_memory_needed(&o, &bytes, NULL), OK);
    void *memory = malloc(bytes);
    raywake_point *flow = malloc(room * sizeof *flow);
    raywake_column *columns = malloc(room * sizeof *columns);
    raywake_tracklet *tracklets = malloc(room * sizeof *tracklets);
    raywake_object *objects = malloc(room * sizeof *objects);
    raywake_estimator *e = NULL;
    EXPECT(raywake_create(&o, memory, bytes, &e, NULL), OK);
    pthread_t other;
    shared = e, stop = 0;
    if (disturbed) pthread_create(&other, NULL, disturb, NULL);
    raywake_result result;
    file_sweep next = {0};
    int sweeps = 0;
    while (next_sweep(file, &next)) {
        CHECK(next.sweep.count <= room);
        if (all) next.sweep.world_from_vehicle = NULL, next.sweep.twist = NULL;
        long before = allocated();
        raywake_status status;
        do status = raywake_step(e, &next.sweep, &result, NULL);
        while (status == RAYWAKE_STATUS_BUSY);
        expect(__LINE__, status, RAYWAKE_STATUS_OK);
        if (!disturbed) {
            EXPECT(raywake_points(e, flow, room, NULL), OK);
            EXPECT(raywake_columns(e, columns, room, NULL), OK);
            EXPECT(raywake_tracklets(e, tracklets, room, NULL), OK);
            if (all) EXPECT(raywake_objects(e, objects, room, NULL), OK);
            EXPECT(raywake_add_to_digest(e, &digest), OK);
        }
        CHECK(allocated() == before);
        sweeps++;
    }
    stop = 1;
    if (disturbed) pthread_join(other, NULL);
    EXPECT(raywake_destroy(e), OK);
    free(objects), free(tracklets), free(columns), free(flow), free(next.points), free(memory);
    fclose(file);
    CHECK(sweeps > 1);
#ifdef COUNT_ALLOCATIONS
    CHECK(allocated() > 0); /* before the first sweep */
#endif
    return digest;
}

int main(int argc, char **argv) {
    if (argc < 2) return 2;
    CHECK(raywake_abi_version() == RAYWAKE_ABI_VERSION && strlen(raywake_version()) > 0);
    options_that_are_none();
    addresses_that_are_none();
    sweeps_that_are_none();
    CHECK(drive(argv[1], 0, 0) == drive(argv[1], 0, 0));
    CHECK(drive(argv[1], 0, 1) == drive(argv[1], 0, 1));
    drive(argv[1], 1, 0);
    CHECK(busy > 0);
    printf("%s; %d calls at the same time were refused\n", failed ? "FAILED" : "passed", busy);
    return failed;
}
