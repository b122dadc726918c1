// Marks the foreground of the sweep before. Twin: core/src/background_filter.rs
@group(0) @binding(0) var<storage, read> params: Step;
struct Table { d: array<i32> }
@group(0) @binding(1) var<storage, read> filter_table: Table;
struct Columns { d: array<vec2<u32>> }
@group(0) @binding(2) var<storage, read> columns_before: Columns;
struct Words { d: array<u32> }
@group(0) @binding(3) var<storage, read_write> marks: Words;

fn score(column: i32) -> i32 {
    let side = params.side;
    let i = column / side;
    let j = column % side;
    var sum = filter_table.d[FILTER_TABLE];
    for (var di = -2; di <= 2; di += 1) { // <= 5
        for (var dj = -2; dj <= 2; dj += 1) { // <= 5
            let ni = i + di;
            let nj = j + dj;
            if ni >= 0 && ni < side && nj >= 0 && nj < side {
                let state = columns_before.d[ni * side + nj].x;
                let patch_at = u32((di + 2) * 5 + dj + 2) * 1024u;
                sum += filter_table.d[patch_at + (state & 0xffu)]
                    + filter_table.d[patch_at + 256u + ((state >> 8u) & 0xffu)]
                    + filter_table.d[patch_at + 512u + ((state >> 16u) & 0xffu)]
                    + filter_table.d[patch_at + 768u + (state >> 24u)];
            }
        }
    }
    return sum;
}

@compute @workgroup_size(ROW_WORKGROUP)
fn background_filter(@builtin(global_invocation_id) id: vec3<u32>) {
    let column = i32(id.x);
    if column >= params.side * params.side {
        return;
    }
    var mark = 0u;
    if columns_before.d[column].y != 0u {
        if params.unfiltered != 0 {
            mark = 1u;
        } else {
            mark = select(0u, 1u, score(column) > 0);
        }
    }
    marks.d[column] = mark;
}
