"""What an array is: `Array` of double precision, in which all is computed; `Single` of single precision, as pixels are.

Units and shapes are told where an array is used: the unit by the end of its name, the shape in brackets beside it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Single = NDArray[np.float32]
