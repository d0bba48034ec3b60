//! Takes the charts' script out of the crate that carries it, compressed as pages hold it.

use std::io::Write;
use std::path::Path;
use std::{env, fs};

use flate2::{Compression, write::GzEncoder};
use plotly::Plot;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // Two scripts: the charts', then one for formulas, which no page has.
    let sources = Plot::offline_js_sources();
    let script =
        sources.split("<script type=\"text/javascript\">").nth(1).and_then(|rest| rest.split("</script>").next());
    let script = script.expect("plotly begins with its own script");
    assert!(script.contains("plotly.js v"), "plotly's own script is the first one");
    let out = env::var_os("OUT_DIR").expect("cargo names the folder for what is built");
    let mut gz = GzEncoder::new(Vec::new(), Compression::best());
    gz.write_all(script.as_bytes()).expect("a vector takes it all");
    fs::write(Path::new(&out).join("plotly.js.gz"), gz.finish().expect("a vector takes it all"))
        .expect("it can be written");
}
