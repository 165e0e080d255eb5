"""Colours as a person tells them apart: CIELAB, and what of it a change of light leaves as it is. Pure maths.

CIE 15:2004, D65 white, sRGB primaries (IEC 61966-2-1). A shadow that takes a share k of the light scales L* + 16, a*
and b* all by the cube root of k as long as no ratio falls below (6/29)^3; so a* and b* over L* + 16 stay, and only
they and, more loosely, L* are compared.
"""

import numpy as np

from perception.calibration.lens import Array

__all__ = ["GREY_WEIGHTS", "features", "lab"]

XYZ_OF_RGB = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
WHITE_XYZ = XYZ_OF_RGB.sum(axis=1)
GREY_WEIGHTS = XYZ_OF_RGB[1]
"""What red, green and blue weigh in the luminance."""
KNEE = 6.0 / 29.0


def lab(rgb: Array) -> Array:
    """Return L*, a*, b* of colours whose channels are linear in the light, 0 to 1.  (n, 3) -> (n, 3)"""
    share = rgb @ XYZ_OF_RGB.T / WHITE_XYZ
    f = np.where(share > KNEE**3, np.cbrt(share), share / (3.0 * KNEE**2) + 4.0 / 29.0)
    return np.column_stack([116.0 * f[:, 1] - 16.0, 500.0 * (f[:, 0] - f[:, 1]), 200.0 * (f[:, 1] - f[:, 2])])


def features(rgb: Array) -> Array:
    """Return lightness L* and the two numbers of chroma that shading leaves alone.  (n, 3) of 0 to 1 -> (n, 3)"""
    found = lab(rgb)
    found[:, 1:] /= (found[:, :1] + 16.0) / 116.0
    return found
