"""Blocks of suns: their size, their progress, and what is kept of them after an interruption."""

from typing import NamedTuple

import numpy as np

from ..settings.memory import check_memory
from ..settings.progress import SUN_STAGE

BYTES_PER_BLOCK = 53e6  # of one array (patches × suns); about six exist at a time
# An interruption loses a block, but small ones make reflections slower: compared to one block of
# all 143 suns, the town's take 8 % longer in blocks of 72, 20 % in blocks of 48, 70 % in blocks of
# 24, and three times as long in blocks of 8. With 24 days (294 suns) Berlin takes 4.9 s of
# processor time in blocks of 49, of 74 and of all suns.
SUNS_PER_BLOCK = 160
FIRST_SUNS = 24  # two days
RAYS_PART = 0.7  # of a block's time, about, where it has reflections too


class SunBlock(NamedTuple):
    """Suns that are traced together."""

    directions: np.ndarray  # (s, 3) float32, unit vectors towards the suns
    weights: np.ndarray  # (s,) float32, in sums over the suns


def block_of_suns(suns, block):
    """SunBlock of a slice of all Suns."""
    return SunBlock(suns.direction[block].astype(np.float32), suns.weight[block].astype(np.float32))


def check_room(prepared, suns, request):
    """Refuse a city whose tracing needs more memory than is free.

    It takes about 1.8 kB for each patch, what 60 % of its rays meet, and six arrays of a block of
    suns: 1.3 GB for Midtown Manhattan, of 393,000 patches with 256 rays, where 1.1 GB beside the
    scene were measured.

    Parameters
    ----------
    prepared : PreparedScene
    suns : Suns
    request : Request

    Raises
    ------
    InputError
    """
    files, count = prepared.scene.report.files, len(prepared.patches)
    block = min(BYTES_PER_BLOCK, 4 * count * min(len(suns), SUNS_PER_BLOCK))
    needed = count * (1800 + 0.6 * 4 * request.samples) + 6 * block
    cure = "give it more memory, fewer --samples or a larger --patch-size"
    # Of fewer triangles a run in tiles is planned as a whole, which takes as much.
    if len(prepared.scene.triangles) > 1e6:
        cure += ", or --cluster serial, which traces a part at a time"
    check_memory(files[0] if files else "the city", f"tracing {count:,} patches", needed, cure)


def cut_into_blocks(suns, patch_count):
    """Blocks of suns, consisting of whole days where these are not too long.

    A block has more suns where the run has more, so that an interruption loses a small share of it:
    a twelfth, or 50 suns (a sixth of 24 days). Only where the matrices of a block would be too
    large does it follow the patches.

    Parameters
    ----------
    suns : Suns
    patch_count : int

    Returns
    -------
    list of slice
    """
    # A twelfth of the suns, but four days (50 suns) at least.
    wanted = min(SUNS_PER_BLOCK, max(50, len(suns) // 12))
    most = max(1, min(wanted, int(BYTES_PER_BLOCK / 4 / max(patch_count, 1))))
    ends, blocks, start = suns.end_of_days, [], 0
    while start < len(suns):
        whole = ends[(ends > start) & (ends <= start + most)]
        stop = int(whole[-1]) if len(whole) else min(start + most, len(suns))
        blocks.append(slice(start, stop))
        start = stop
    return blocks


def count_kept(suns, blocks):
    """Number of usable suns if only these blocks were traced: the end of one of the
    blocks, or 0.
    """
    useful = np.intersect1d([block.stop for block in blocks], suns.end_of_days)
    return int(useful[-1]) if len(useful) else 0


class SunProgress:
    """Reports the progress over all suns: of each block its rays, then its reflections.

    Parameters
    ----------
    progress : callable
        See `core.settings.progress`.
    count : int
        Number of all suns.
    bounces : int
        Number of bounces of each block, after its rays: in all states of trees together.
    """

    def __init__(self, progress, count, bounces):
        self.progress, self.count, self.bounces = progress, count, bounces
        self.rays_before = self.rays = self.bounces_before = 0

    def begin(self, block):
        """Start a block of suns, given as a slice."""
        self.block, self.rays_before = block, self.rays
        if block.start == 0:
            self.progress(SUN_STAGE, 0, self.count, "suns")

    def report_rays(self, share, rays):
        """Report the share of the block's rays that are traced, and their number."""
        self.rays = self.rays_before + rays
        self._report(share * (RAYS_PART if self.bounces else 1))

    def report_bounce(self, bounce):
        """Report the bounces done in a state, but not the last of all: nothing is cancelled between
        it and `end`.
        """
        done = self.bounces_before + bounce
        if done < self.bounces:
            self._report(RAYS_PART + (1 - RAYS_PART) * done / self.bounces)

    def end(self):
        """Report that the block is finished and kept."""
        self._report(1)

    def _report(self, share):
        suns = self.block.start + share * (self.block.stop - self.block.start)
        done = (
            (self.rays, self.rays * self.count / suns, "rays")
            if self.rays
            else (suns, self.count, "suns")
        )
        self.progress(SUN_STAGE, *done)
