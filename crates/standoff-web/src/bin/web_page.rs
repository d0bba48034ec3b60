//! Makes the page that flies missions: `web-page WASM OUT`, with the library compiled to WebAssembly.

use std::process::ExitCode;

use standoff_view::page::flight_page;
use wasm_bindgen_cli_support::Bindgen;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [wasm, out] = arguments.as_slice() else {
        eprintln!("usage: web-page WASM OUT");
        return ExitCode::from(2);
    };
    match page(wasm).and_then(|page| std::fs::write(out, page).map_err(|error| format!("{out}: {error}"))) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(1)
        }
    }
}

/// Makes the page with the library in the file `wasm`.
fn page(wasm: &str) -> Result<String, String> {
    let mut bindgen = Bindgen::new();
    let bindgen = bindgen.input_path(wasm).no_modules(true).map_err(|error| error.to_string())?;
    let mut output = bindgen.typescript(false).generate_output().map_err(|error| format!("{wasm}: {error:#}"))?;
    let engine = output.wasm_mut().emit_wasm();
    Ok(flight_page(&engine, output.js(), &standoff_web::scenarios()))
}
