//! `make bench-ci`: latencies of the network, of the loop and through shared memory, side by side in one run.

mod kernel;
mod table;

fn main() {
    let bytes = std::fs::read("models/untrained.onnx").unwrap();
    let _ = ravenpose::realtime::pin(1);
    let _ = ravenpose::realtime::set_fifo(80);
    println!("{}", kernel::run(&bytes, 4000).unwrap());
}
