"""The block of light behind the virtual probe: reference ray tracer, lookup table, and the errors between them."""
