//! Extracts the chart script (plotly.js) from the `plotly` crate and compresses it for embedding in pages.

use std::io::Write;
use std::path::Path;
use std::{env, fs};

use flate2::{Compression, write::GzEncoder};
use plotly::Plot;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // The sources contain two scripts: plotly.js, and one for formulas, which the pages do not use.
    let sources = Plot::offline_js_sources();
    let script =
        sources.split("<script type=\"text/javascript\">").nth(1).and_then(|rest| rest.split("</script>").next());
    let script = script.expect("the sources start with a script element");
    assert!(script.contains("plotly.js v"), "the first script is plotly.js");
    let out = env::var_os("OUT_DIR").expect("cargo sets OUT_DIR");
    let mut gz = GzEncoder::new(Vec::new(), Compression::best());
    gz.write_all(script.as_bytes()).expect("writing to a vector cannot fail");
    fs::write(Path::new(&out).join("plotly.js.gz"), gz.finish().expect("writing to a vector cannot fail"))
        .expect("OUT_DIR is writable");
}
