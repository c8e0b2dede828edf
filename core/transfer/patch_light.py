"""Light of patches whose random points go on from round to round: what the noise of several rounds is told from."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import sparse

from ..patches.patches import Patches


class Round(NamedTuple):
    """Which part of a run is traced."""

    size: int = 1  # samples, in units of those of the first round
    counted: np.ndarray | None = None  # (n,) bool, surfaces that the round is for; None: all
    alone: bool = False  # whether only these are traced, under the light of the others as it is known


class Net(NamedTuple):
    """Annual light without reflections at the points of a digital net on each of k patches."""

    before: int  # points of the sequence before it
    light: np.ndarray  # (k, m) float32, in the order of `points_of_grid`


class OwnNoise(NamedTuple):
    """Variance of n surfaces' light from their own rays and points."""

    diffuse: np.ndarray  # (n,)
    direct: np.ndarray  # (n,) of the annual mean
    covariance: np.ndarray  # (n,) of both
    points: np.ndarray  # (n,) part of `direct`


@dataclass
class PatchFacts:
    """What does not change from round to round on k patches."""

    patches: Patches
    covered: np.ndarray  # (k, cells) bool, cells that lie inside or under something
    sky: np.ndarray  # (k,) float32, visible share
    rays: int  # by which it was found
    sent: np.ndarray  # (k,) bool, whether the patch sends shadow rays
    squares: sparse.csr_matrix  # (n, k), squares of the weights in the means of surfaces
    suns: tuple  # SunBlock: directions and weights


class Emitted(NamedTuple):
    """What all p patches emit, by the last round in which all were traced; None without reflections."""

    sky: np.ndarray | None  # (p, cells) float32, radiosity under the sky
    suns: np.ndarray | None  # (p, cells) float32, annual under the suns
    far_ground: float  # annual radiosity of the far ground under the suns


class Uneven(NamedTuple):
    """What the patch-size error of n surfaces is told from: linear in their light, so that rounds can be averaged."""

    received: np.ndarray  # (n, 2) of `Steps`, averaged over patches
    variance: np.ndarray  # (n,) of the former, by the surfaces' own rays
    light: np.ndarray  # (n,) all light


@dataclass
class PatchLight:
    """Light of k patches by one or several rounds."""

    rows: np.ndarray  # (k,) int, patches, ascending
    round: Round
    facts: PatchFacts
    diffuse: np.ndarray  # (k, r) float32, all light of the sky by each replicate of the rays
    reflected: np.ndarray  # (k, r) float32, annual reflected light of the suns likewise
    nets: list  # of Net
    emitted: Emitted
    own: OwnNoise  # of these patches
    rest: OwnNoise  # of all others, and of light by way of mirrors
    # Uneven of all n surfaces in light of the sky, and annual light of the suns; None without reflections.
    uneven: tuple = (None, None)
