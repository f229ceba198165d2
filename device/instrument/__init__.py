"""The procedure: from a press that begins to a measurement that is kept."""
