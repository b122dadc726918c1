// Lists the marked columns in order, from the prefix sum of the marks. Twin: core/src/compact.rs
struct Words { d: array<u32> }
@group(0) @binding(0) var<storage, read> marks: Words;
@group(0) @binding(1) var<storage, read_write> rank: Words;
@group(0) @binding(2) var<storage, read_write> foreground: Words;
@group(0) @binding(3) var<storage, read_write> counters: Words;

@compute @workgroup_size(WORKGROUP)
fn compact(@builtin(global_invocation_id) id: vec3<u32>) {
    let column = id.x;
    let columns = arrayLength(&marks.d);
    if column >= columns {
        return;
    }
    let place = rank.d[column];
    let mark = marks.d[column];
    if column == columns - 1u {
        counters.d[FOREGROUND_MARKED] = place + mark;
        counters.d[FOREGROUND_COUNT] = min(place + mark, arrayLength(&foreground.d));
    }
    rank.d[column] = NONE;
    if mark != 0u && place < arrayLength(&foreground.d) {
        foreground.d[place] = column;
        rank.d[column] = place;
    }
}
