//! Packets of a Velodyne sensor; the tests of `raywake-io` use them, too.

/// A packet of a sensor that sees something 10 m away all around; `n` counts packets, 75 per
/// revolution.
pub fn velodyne(n: u32) -> Vec<u8> {
    let block = |block: u32| {
        let azimuth = ((n * 12 + block) * 40 % 36_000) as u16;
        [&[0xff, 0xee][..], &azimuth.to_le_bytes(), &[0x88, 0x13, 51].repeat(32)].concat()
    };
    let blocks: Vec<u8> = (0..12).flat_map(block).collect();
    [&blocks[..], &(n * 1327).to_le_bytes(), &[0x37, 0x22]].concat()
}
