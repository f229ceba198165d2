"""What the forward model is worth: benchmarks with known answers, and the documents written from them."""
