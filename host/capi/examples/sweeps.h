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
