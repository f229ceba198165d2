"""Pure numbers in, numbers out: what a press means. Shared with the workstation; imports nothing else of ours."""
