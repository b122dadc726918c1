use super::*;
use crate::scratch::Scratch;
use std::io::Write;

/// IDX file with these counts.
fn idx(magic: u32, counts: &[u32], bytes: &[u8]) -> Vec<u8> {
    let head = [magic].into_iter().chain(counts.iter().copied());
    head.flat_map(u32::to_be_bytes).chain(bytes.iter().copied()).collect()
}

/// `count` pictures of 2 x 2 and their digits, cycling.
fn files(count: u32) -> [Vec<u8>; 2] {
    let pixels: Vec<u8> = (0..4 * count).map(|n| (n % 256) as u8).collect();
    let labels: Vec<u8> = (0..count).map(|n| (n % 10) as u8).collect();
    [idx(0x803, &[count, 2, 2], &pixels), idx(0x801, &[count], &labels)]
}

const IMAGES: &str = "t10k-images-idx3-ubyte";
const LABELS: &str = "t10k-labels-idx1-ubyte";

#[test]
fn idx_plain_and_packed() {
    let scratch = Scratch::new();
    let [images, labels] = files(500);
    scratch.write(IMAGES, images);
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packed.write_all(&labels).unwrap();
    scratch.write("t10k-labels-idx1-ubyte.gz", packed.finish().unwrap());
    let sets = open(scratch.path(), 1).unwrap();
    assert_eq!((sets.training.count(), sets.test.count(), sets.test.pixels), (400, 100, 4));
    for n in 0..100 {
        let first = (255.0 * sets.test.picture(n)[0]).round() as usize;
        let digits = (0..500).filter(|n| 4 * n % 256 == first).map(|n| (n % 10) as u8);
        assert!(digits.into_iter().any(|d| d == sets.test.labels[n]));
    }
    assert_eq!(open(scratch.path(), 1).unwrap(), sets);
    assert_ne!(open(scratch.path(), 2).unwrap().test, sets.test);
}

#[test]
fn training_and_test_apart() {
    let scratch = Scratch::new();
    for (name, count) in [("train", 60), ("t10k", 20)] {
        let [images, labels] = files(count);
        scratch.write(&format!("{name}-images-idx3-ubyte"), images);
        scratch.write(&format!("{name}-labels-idx1-ubyte"), labels);
    }
    let sets = open(scratch.path(), 1).unwrap();
    assert_eq!((sets.training.count(), sets.test.count()), (60, 20));
}

#[test]
fn errors_are_named() {
    let [images, labels] = files(100);
    let cases: [(&str, Vec<u8>, Vec<u8>); 6] = [
        ("99 labels", images.clone(), files(99)[1].clone()),
        ("bytes for counts", images[..300].to_vec(), labels.clone()),
        ("cut off within its header", images[..9].to_vec(), labels.clone()),
        ("begins with 0x803", images.clone(), images.clone()),
        ("bytes for counts", idx(0x803, &[u32::MAX; 3], &[]), labels.clone()),
        ("is 10", images.clone(), idx(0x801, &[100], &[10; 100])),
    ];
    for (told, images, labels) in cases {
        let scratch = Scratch::new();
        scratch.write(IMAGES, images);
        scratch.write(LABELS, labels);
        let error = open(scratch.path(), 1).unwrap_err().to_string();
        assert!(error.contains(told), "{told}: {error}");
    }
    let scratch = Scratch::new();
    assert!(open(scratch.path(), 1).unwrap_err().to_string().contains("no digits"));
    scratch.write(IMAGES, images);
    assert!(open(scratch.path(), 1).unwrap_err().to_string().contains("labels are missing"));
    scratch.write(LABELS, idx(0x801, &[100], &[3; 100]));
    assert!(open(scratch.path(), 1).unwrap_err().to_string().contains("no 0 among"));
    scratch.write("t10k-labels-idx1-ubyte.gz", b"\x1f\x8bno gzip");
    std::fs::remove_file(scratch.path().join(LABELS)).unwrap();
    assert!(open(scratch.path(), 1).is_err());
}

#[test]
fn numbers_in_lines() {
    let line = |n: usize| format!("0,{},16,8,{}\n", n % 17, n % 10);
    let text: String = (0..200).map(line).collect();
    let scratch = Scratch::new();
    let sets = open(&scratch.write("digits.csv", &text), 1).unwrap();
    assert_eq!((sets.training.count(), sets.test.count(), sets.test.pixels), (160, 40, 4));
    assert_eq!(sets.test.picture(0)[2..], [1.0, 0.5]);
    for (line, told) in [
        ("0,1,2,3,10\n", "not a digit"),
        ("0,1,2,17,1\n", "pixel"),
        ("0,1,x,3,1\n", "numbers"),
        ("0,1,2,1\n", "line: 201"),
    ] {
        let path = scratch.write("digits.csv", &(text.clone() + line));
        let error = open(&path, 1).unwrap_err().to_string();
        assert!(error.contains(told) && error.contains("201"), "{told}: {error}");
    }
}

#[test]
fn a_file_for_each_digit() {
    let scratch = Scratch::new();
    let picture = vec!["0.5"; 784].join(",");
    for digit in 0..10 {
        let all = vec![picture.clone(); 10 + digit].join(",");
        scratch.write(&format!("{digit}.json"), format!("{{\"data\": [{all}]}}"));
    }
    let sets = open(scratch.path(), 3).unwrap();
    assert_eq!((sets.training.count(), sets.test.count()), (116, 29));
    for (text, told) in [("{\"data\": [0, 1]}", "not a multiple"), ("{", "line 1")] {
        scratch.write("3.json", text);
        let error = open(scratch.path(), 3).unwrap_err().to_string();
        assert!(error.contains("3.json") && error.contains(told), "{error}");
    }
    scratch.write("3.json", format!("{{\"data\": [{}]}}", vec!["2"; 784].join(",")));
    assert!(open(scratch.path(), 3).unwrap_err().to_string().contains("brightness"));
}
