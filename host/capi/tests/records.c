/* Steps through a file of dump_sweeps and writes the records of the last step to another: for
 * columns, returns, tracklets and objects the count (8 bytes) and the records.
 *
 *     ./records FILE RECORDS
 */
#include "../examples/sweeps.h"

static void must(raywake_status status) {
    if (status != RAYWAKE_STATUS_OK) {
        fprintf(stderr, "%s\n", raywake_status_text(status));
        exit(1);
    }
}

static void *room_for(size_t bytes) {
    void *memory = calloc(1, bytes);
    if (!memory) exit(6);
    return memory;
}

int main(int argc, char **argv) {
    FILE *file = argc == 3 ? fopen(argv[1], "rb") : NULL;
    FILE *out = file ? fopen(argv[2], "wb") : NULL;
    if (!out) return 2;
    raywake_options options = rig_of(file);
    options.objects = 1;
    size_t bytes = 0;
    must(raywake_memory_needed(&options, &bytes, NULL));
    raywake_estimator *estimator = NULL;
    must(raywake_create(&options, room_for(bytes), bytes, &estimator, NULL));
    file_sweep next = {0};
    while (next_sweep(file, &next)) must(raywake_step(estimator, &next.sweep, NULL, NULL));
#define WRITE(read, type)                                                                        \
    do {                                                                                         \
        size_t count = 0;                                                                        \
        must(read(estimator, NULL, 0, &count));                                                  \
        type *records = room_for(count * sizeof *records);                                       \
        must(read(estimator, records, count, NULL));                                             \
        uint64_t wide = count;                                                                   \
        fwrite(&wide, sizeof wide, 1, out);                                                      \
        fwrite(records, sizeof *records, count, out);                                            \
    } while (0)
    WRITE(raywake_columns, raywake_column);
    WRITE(raywake_points, raywake_point);
    WRITE(raywake_tracklets, raywake_tracklet);
    WRITE(raywake_objects, raywake_object);
    return fclose(out) ? 5 : 0;
}
