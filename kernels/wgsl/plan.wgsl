// Group counts of the indirect dispatches, from the counts so far. It has no twin: the scalar
// backend loops over slices.

fn set_groups(at: u32, groups: u32) {
    counters.d[at] = groups;
    counters.d[at + 1u] = 1u;
    counters.d[at + 2u] = 1u;
}

@compute @workgroup_size(1)
fn plan() {
    let distinct = min(counters.d[DISTINCT_COUNT], POINTS_MAX);
    let foreground = min(counters.d[FOREGROUND_COUNT], FOREGROUND_MAX);
    set_groups(GROUPS_DISTINCT, (distinct + ROW_WORKGROUP - 1u) / ROW_WORKGROUP);
    set_groups(GROUPS_FOREGROUND, (foreground + ROW_WORKGROUP - 1u) / ROW_WORKGROUP);
    set_groups(GROUPS_ROWS, foreground);
}
