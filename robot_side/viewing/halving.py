"""Pictures of half the size, for a narrow link."""

import numpy as np
import numpy.typing as npt


def halved(picture: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Return a picture of half the size, from the means of two by two pixels: (2h, 2w, 3) to (h, w, 3).

    An odd last row or column is left out.
    """
    height, width = picture.shape[0] // 2 * 2, picture.shape[1] // 2 * 2
    rows = picture[0:height:2].astype(np.uint16) + picture[1:height:2]
    half: npt.NDArray[np.uint8] = ((rows[:, 0:width:2] + rows[:, 1:width:2] + 2) >> 2).astype(np.uint8)
    return np.ascontiguousarray(half)
