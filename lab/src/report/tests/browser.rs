//! The page in a browser.

use super::example;
use crate::scratch::Scratch;
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Appended to a copy of the page: reports in the title how many images the browser could show, and
/// how many charts have a size.
const COUNT: &str = "<script>window.onload = () => { \
    const shown = [...document.images].filter(i => i.complete && i.naturalWidth > 100).length; \
    const drawn = [...document.querySelectorAll('svg[role=img]')] \
        .filter(s => s.getBoundingClientRect().height > 100).length; \
    const wide = document.documentElement.scrollWidth > innerWidth; \
    document.title = 'images ' + shown + ' charts ' + drawn + ' overflow ' + wide; }</script>";

/// `RAYWAKE_BROWSER`, or a browser on the path.
fn browser() -> PathBuf {
    if let Some(named) = std::env::var_os("RAYWAKE_BROWSER") {
        return named.into();
    }
    let names = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
    let path = std::env::var_os("PATH").unwrap_or_default();
    let found =
        std::env::split_paths(&path).flat_map(|p| names.map(|n| p.join(n))).find(|p| p.is_file());
    found.expect("no browser: install chromium, or name one with RAYWAKE_BROWSER")
}

#[test]
#[ignore = "needs Chromium, on PATH or named by RAYWAKE_BROWSER"]
fn a_browser_shows_every_picture() {
    let folder = Scratch::new();
    example::report().write(folder.path()).unwrap();
    let page = fs::read_to_string(folder.path().join("report.html")).unwrap();
    let copy = folder.path().join("copy.html");
    fs::write(&copy, page.replace("</body>", &format!("{COUNT}</body>"))).unwrap();
    let dom = folder.path().join("dom.txt");
    let mut child = Command::new(browser())
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--dump-dom",
            "--window-size=1280,900",
        ])
        .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
        .arg(format!("file://{}", copy.display()))
        .stdout(fs::File::create(&dom).unwrap())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let end = Instant::now() + Duration::from_secs(60);
    while child.try_wait().unwrap().is_none() {
        if Instant::now() > end {
            child.kill().unwrap();
            panic!("the browser did not end within a minute");
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    let dom = fs::read_to_string(dom).unwrap();
    let title = dom.split("<title>").nth(1).and_then(|t| t.split("</title>").next());
    assert_eq!(title, Some("images 1 charts 8 overflow false"));
}
