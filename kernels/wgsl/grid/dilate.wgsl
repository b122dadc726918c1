// The foreground grown by one column either way. Twin: core/src/stages/grid/dilate.rs
@compute @workgroup_size(WORKGROUP)
fn dilate(@builtin(global_invocation_id) id: vec3<u32>) {
    let side = sweep.side;
    let column = i32(id.x);
    if column >= side * side {
        return;
    }
    var any = 0u;
    for (var di = -1; di <= 1; di += 1) {
        for (var dj = -1; dj <= 1; dj += 1) {
            let i = column / side + di;
            let j = column % side + dj;
            if i >= 0 && i < side && j >= 0 && j < side {
                any |= foreground_marks.d[i * side + j];
            }
        }
    }
    dilated_marks.d[column] = select(0u, 1u, any != 0u);
}
