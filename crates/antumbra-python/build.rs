//! An extension module leaves Python's symbols to the interpreter, which macOS wants to be told.

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
