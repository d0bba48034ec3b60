//! Takes the charts' script, as it is, out of the folder of the crate that carries it, and packs it as pages hold it.
//!
//! Cargo has fetched that folder, and says where it is: nothing is downloaded here. The crate gives the script in HTML
//! only, together with another one.

use std::io::Write;
use std::path::Path;
use std::{env, fs};

use cargo_metadata::MetadataCommand;
use flate2::{Compression, write::GzEncoder};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let metadata =
        MetadataCommand::new().other_options(["--frozen".to_owned()]).exec().expect("cargo knows its crates");
    let plotly = metadata.packages.iter().find(|package| package.name == "plotly").expect("it is a dependency of ours");
    let script = plotly.manifest_path.with_file_name("resource/plotly.min.js");
    let script =
        fs::read(&script).unwrap_or_else(|reason| panic!("{script}: {reason}: is it elsewhere in this version?"));
    assert!(script[..200].windows(11).any(|words| words == b"plotly.js v"), "it begins with its name");
    let out = env::var_os("OUT_DIR").expect("cargo names the folder for what is built");
    let mut gz = GzEncoder::new(Vec::new(), Compression::best());
    gz.write_all(&script).expect("a vector takes it all");
    fs::write(Path::new(&out).join("plotly.js.gz"), gz.finish().expect("a vector takes it all"))
        .expect("it can be written");
}
