// Lists the marked columns in order, from the prefix sum of the marks. Twin:
// core/src/stages/compact.rs

@compute @workgroup_size(WORKGROUP)
fn compact(@builtin(global_invocation_id) id: vec3<u32>) {
    let column = id.x;
    let columns = arrayLength(&foreground_marks.d);
    if column >= columns {
        return;
    }
    let place = foreground_index.d[column];
    let mark = foreground_marks.d[column];
    if column == columns - 1u {
        counters.d[FOREGROUND_MARKED] = place + mark;
        counters.d[FOREGROUND_COUNT] = min(place + mark, arrayLength(&foreground.d));
    }
    foreground_index.d[column] = NONE;
    if mark != 0u && place < arrayLength(&foreground.d) {
        foreground.d[place] = column;
        foreground_index.d[column] = place;
    }
}
