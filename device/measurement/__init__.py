"""Pure numbers in, numbers out: what a press means. Shared by the probe and the workstation; imports nothing else of ours."""
