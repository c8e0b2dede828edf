"""What rays of patches met: RowLight of some patches, and Traced of all patches of a city.

       sky                        A ray that escapes upwards reaches the sky, one that escapes
                                  downwards the far
    \\   |   /                      ground. A ray that hits the front of a patch links the two in
    the matrix F.
 hit ←  \\|/ → far ground          A ray that hits a back carries nothing.
═════════════ patch
"""

from dataclasses import dataclass, field

import numpy as np

from ..patches.facing_scene import FacingScene
from ..patches.patches import Patches
from ..rays.hemisphere_rays import CELL_DIVISIONS
from ..rays.sample_points import HEMISPHERE_REPLICATES
from ..sky.horizon import TerrainHorizon
from .form_factors import FormFactors, Rows

# of deviations stored as 16-bit integers; the range ends at eight times full light
STEP = np.float32(1 / 4096)
SKY_DOME = "sky"  # the name of its first light; the others have names in `sky.sky_models`


@dataclass(kw_only=True)
class RayCity:
    """What rays are traced in, and what is wanted of them."""

    ray_scene: FacingScene
    patches: Patches
    threads: int = 1
    reflections: bool = True  # whether to collect the matrix of form factors
    # (p, CELL_DIVISIONS²) bool, where it is known, as in a room that is lit inside
    covered: np.ndarray | None = None
    # (p,) uint64, cells whose light does not count in the means of their patches, as of
    # `measure_cover.choose_left_out`; None: no cells
    left_out: np.ndarray | None = None
    elements: int = 1  # of each patch: 1, 4 or 16
    # elements by which the starts of rays are resolved in that matrix: all or 1
    start_elements: int = 1
    # rays that leave below it reach the far ground, not the sky
    terrain: TerrainHorizon | None = None
    sources: tuple = ()  # of HorizonBand: further parts of the sky that patches look at
    rays_share: int = 4  # hemisphere rays for each ray towards one of them


@dataclass
class FirstLight:
    """Light of the sky, or of a source in it, on p patches before reflections: the visible share of
    the sky.
    """

    light: np.ndarray  # (p, HEMISPHERE_REPLICATES) float32
    # (p, elements) float32, of their open part; of the whole patch if too few rays start there
    element: np.ndarray
    # (p, elements, HEMISPHERE_REPLICATES) int16, of each replicate from the mean, in units
    deviation: np.ndarray
    unit: np.ndarray | np.float32 = STEP  # of `deviation`; or (p,) float32

    def put(self, rows, part):
        """Replace the light of some patches."""
        self.light[rows], self.element[rows], self.deviation[rows] = (
            part.light,
            part.element,
            part.deviation,
        )

    def append(self, rows, part, share):
        """The mean with the light of some patches by further rays, `share` of all rays, (c, 1)
        float32.
        """
        self.light[rows] += share * (part.light - self.light[rows])
        self.element[rows] += share * (part.element - self.element[rows])
        apart = part.deviation.astype(np.float32) - self.deviation[rows]
        self.deviation[rows] += np.rint(share[:, :, None] * apart).astype(np.int16)


def no_light(count, elements, unit=STEP):
    """FirstLight of `count` patches that see nothing."""
    shape = count, elements, HEMISPHERE_REPLICATES
    light, element = np.zeros((count, shape[2]), np.float32), np.zeros(shape[:2], np.float32)
    return FirstLight(light, element, np.zeros(shape, np.int16), unit)


@dataclass
class RowLight:
    """What the rays of c patches met; and d patches that send none, since they lie wholly inside
    something.
    """

    rows: np.ndarray  # (c,) int
    covered: np.ndarray  # (c, CELL_DIVISIONS²) bool, cells that lie inside or under something
    enclosed_rows: np.ndarray  # (d,) int
    first: dict  # of the sky, and of each source by its name: FirstLight
    # (c, HEMISPHERE_REPLICATES) float32, share of rays that escape below the horizon
    far_ground: np.ndarray
    # (c, elements) float32, share of all rays that start there and do so
    element_far_ground: np.ndarray
    # (c, elements) float32, share of the rays of each element that start in the open
    open_share: np.ndarray
    hits: Rows | None  # without reflections None
    ray_count: dict  # rays towards the sky, and towards each source


@dataclass
class Traced:
    """RowLight of all p patches, to which rays can be added. Those without rows see nothing, all in
    the open.
    """

    first: dict
    far_ground: np.ndarray  # (p, HEMISPHERE_REPLICATES) float32
    # (p, elements) float32; None once the element factors are known
    element_far_ground: np.ndarray | None
    open_share: np.ndarray | None  # (p, elements) float32; likewise
    covered: np.ndarray  # (p, CELL_DIVISIONS²) bool
    form_factors: FormFactors | None
    ray_count: dict = field(default_factory=dict)
    # (p, elements) float32, of `element_factors`; None without reflections
    factor: np.ndarray | None = None
    samples: np.ndarray | None = None  # (p,) int32, hemisphere rays asked of each patch; 0: none

    def put(self, part):
        """Write the rows of a RowLight."""
        for name, first in self.first.items():
            first.put(part.rows, part.first[name])
            first.put(part.enclosed_rows, no_light(len(part.enclosed_rows), first.element.shape[1]))
            self.ray_count[name] = self.ray_count.get(name, 0) + part.ray_count[name]
        for name, dark in (
            ("far_ground", 0),
            ("element_far_ground", 0),
            ("open_share", 0),
            ("covered", True),
        ):
            values = getattr(self, name)
            values[part.rows], values[part.enclosed_rows] = getattr(part, name), dark
        if part.hits is not None:
            self.form_factors.put(part.hits)

    def append(self, part, count):
        """Add what `count` further rays of each patch of a RowLight met."""
        rows = part.rows
        # Running mean: the new rays have as much weight as they are many.
        share = (count / (self.samples[rows] + count)).astype(np.float32)[:, None]
        for name, first in self.first.items():
            first.append(rows, part.first[name], share)
            self.ray_count[name] += part.ray_count[name]
        for name in ("far_ground", "element_far_ground", "open_share"):
            values = getattr(self, name)
            values[rows] += share * (getattr(part, name) - values[rows])
        if part.hits is not None:
            self.form_factors.put(part.hits)
        self.samples[rows] += count
        self.samples[part.enclosed_rows] += count

    @property
    def nbytes(self):
        """Bytes of the hits, which grow with every round."""
        return (
            sum(rows.key.nbytes for rows in self.form_factors.rows)
            if self.form_factors is not None
            else 0
        )

    @property
    def sky(self):
        """Share of rays that reach the sky: (p, HEMISPHERE_REPLICATES) float32."""
        return self.first[SKY_DOME].light

    @property
    def covered_share(self):
        """Share of each patch that lies inside or under something: (p,) float32."""
        return self.covered.mean(axis=1, dtype=np.float32)

    @staticmethod
    def empty(city):
        """Traced of patches that sent no rays yet."""
        count, elements = len(city.patches), city.elements
        first = {SKY_DOME: no_light(count, elements)}
        for source in city.sources:
            unshaded = source.unshaded(city.patches.normal).astype(np.float32)
            first[source.name] = no_light(count, elements, STEP * unshaded)
        form_factors = FormFactors(
            [[]], count, elements, np.zeros(count, np.int32), city.start_elements
        )
        return Traced(
            first=first,
            far_ground=np.zeros((count, HEMISPHERE_REPLICATES), np.float32),
            element_far_ground=np.zeros((count, elements), np.float32),
            open_share=np.ones((count, elements), np.float32),
            covered=np.zeros((count, CELL_DIVISIONS**2), bool),
            form_factors=form_factors if city.reflections else None,
            ray_count=dict.fromkeys(first, 0),
            samples=np.zeros(count, np.int32),
        )
