/* Replays a file written by `dump_sweeps` and prints what moves, and the digest that the program
 * `raywake` prints for the same sweeps.
 *
 *     cc replay.c $(pkg-config --cflags --libs raywake) -o replay
 *     ./replay FILE [THREADS]
 */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <raywake.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "sweeps.h"

static void *room_for(size_t bytes) {
    void *memory = malloc(bytes ? bytes : 1);
    if (!memory) {
        fprintf(stderr, "no memory for %zu bytes\n", bytes);
        exit(6);
    }
    return memory;
}

static void must(raywake_status status, const char *what, const raywake_error *error) {
    if (status != RAYWAKE_STATUS_OK) {
        fprintf(stderr, "%s: %s: %s\n", what, raywake_status_text(status), error ? error->text : "");
        exit(1);
    }
}

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int by_size(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

int main(int argc, char **argv) {
    enum { STEPS_MAX = 10000 };
    static double times[STEPS_MAX];
    FILE *file = argc > 1 ? fopen(argv[1], "rb") : NULL;
    if (!file) {
        fprintf(stderr, "replay FILE [THREADS]\n");
        return 2;
    }
    raywake_options options = rig_of(file);
    options.objects = 1;
    options.threads = argc > 2 ? (uint32_t)strtoul(argv[2], NULL, 10) : 0;

    raywake_error error;
    size_t bytes = 0;
    must(raywake_memory_needed(&options, &bytes, &error), "memory", &error);
    void *memory = room_for(bytes);
    raywake_estimator *estimator = NULL;
    must(raywake_create(&options, memory, bytes, &estimator, &error), "create", &error);

    uint64_t digest = RAYWAKE_DIGEST_START;
    size_t room = 0, steps = 0, count = 0;
    file_sweep next = {0};
    raywake_point *flow = NULL;
    static raywake_object objects[RAYWAKE_OBJECTS_MAX];
    while (next_sweep(file, &next)) {
        if (next.room > room) {
            room = next.room;
            free(flow);
            flow = room_for(room * sizeof *flow);
        }
        raywake_result result;
        double start = seconds();
        must(raywake_step(estimator, &next.sweep, &result, &error), "step", &error);
        if (steps < STEPS_MAX) times[steps++] = 1e3 * (seconds() - start);

        size_t moving = 0, driving = 0, seen = 0;
        must(raywake_points(estimator, flow, room, &count), "points", NULL);
        for (size_t n = 0; n < count && n < room; n++) moving += flow[n].status == 1;
        must(raywake_objects(estimator, objects, RAYWAKE_OBJECTS_MAX, &seen), "objects", NULL);
        for (size_t n = 0; n < seen; n++) driving += objects[n].moves;
        must(raywake_add_to_digest(estimator, &digest), "digest", NULL);
        printf("%.3f s: %zu columns, %zu returns, %zu of them moving, %zu tracklets, %zu objects, "
               "%zu of them moving\n",
               next.sweep.stamp_s, result.columns, result.points, moving, result.tracklets,
               result.objects, driving);
    }
    must(raywake_destroy(estimator), "destroy", NULL);
    free(flow);
    free(next.points);
    free(memory);
    fclose(file);
    if (steps > 1) {
        qsort(times + 1, steps - 1, sizeof times[0], by_size);
        printf("median     %.2f ms a step, %zu bytes\n", times[steps / 2], bytes);
    }
    printf("digest     %016llx\n", (unsigned long long)digest);
    return 0;
}
