"""Of `gpiod.line`, what one output needs."""

from enum import Enum

Direction = Enum("Direction", ["INPUT", "OUTPUT"])
Value = Enum("Value", {"INACTIVE": 0, "ACTIVE": 1})
