"""REST, events and the device's screen: what a hospital PC calls and what the operator sees."""
