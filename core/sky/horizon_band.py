"""The horizon as a source of light: a band of uniform azimuth, weighed like a line at the horizon
itself.

             normal n
               ↑   ╱ d: towards the band, at azimuth φ from n, 0° to 6.5° high
    surface ═══╪══╱════
               │ ╱ φ

Perez's horizon gives an unshaded surface F₂ sin β, for every azimuth. So does a uniform line at
elevation 0, per its irradiance of a wall:

    H = ½ ∫ max(0, n · d_h(φ)) V(φ) dφ,    d_h horizontal,    ½ sin β ∫ cos φ dφ = sin β  where V = 1

V(φ) is the visible share of the band at azimuth φ. A line without height would be hidden by the
slightest rise of the ground: Perez et al. (1987) give their band 6.5°, and so much of it may hide
behind a rise here. What a surface that leans forward cannot see of the band, because it is behind
its own plane, is not missed.

References
----------
R. Perez, R. Seals, P. Ineichen, R. Stewart, D. Menicucci (1987), A new simplified version of the
Perez diffuse irradiance model for tilted surfaces. :doi:`10.1016/S0038-092X(87)80031-2`
"""

import numpy as np

HEIGHT = np.radians(6.5)  # [rad] of the band


class HorizonBand:
    """The part of the sky that has rays and photons of its own; its light is stated per light of an
    unshaded wall.
    """

    # of its values in a Transfer, of its variables in files, and of the stage in which it is traced
    name = "horizon"
    title = "the horizon"  # in messages
    unit = "light of an unshaded wall"  # in descriptions of variables
    stream = np.uint64(0x4071)  # sets the random numbers of its rays apart
    # region of `pvlib.iam.marion_diffuse` whose incidence angle modifier its light gets
    incidence = "horizon"
    radiance = np.pi / (HEIGHT + np.sin(2 * HEIGHT) / 2)  # π times its own
    # light lost with a cosine-weighted share of the sky less than 2° above the level
    low = np.pi / (2 * HEIGHT)
    # Photons: power through lid, bottom and sides of a box, per area, (6,). A beam from azimuth φ
    # and elevation e has the normal irradiance dφ de / (2 HEIGHT cos e).
    sides = np.array([-np.pi * np.log(np.cos(HEIGHT)) / HEIGHT, 0, 1, 1, 1, 1])

    def variable(self, field):
        """Name of a field of its SourceLight in files and messages."""
        return f"{self.name}_{'relative_' if field == 'standard_error' else ''}{field}"

    def unshaded(self, normal):
        """Light on unobstructed surfaces, sin(tilt), from their normals (n, 3): (n,)."""
        return np.hypot(normal[:, 0], normal[:, 1])

    def contains(self, directions):
        """Whether directions of the sky, (m, 3), lie in the band: (m,) bool."""
        return directions[:, 2] < np.sin(HEIGHT)

    def sample(self, normal, along, up):
        """Directions towards the band, with density n · d_h in azimuth.

        Parameters
        ----------
        normal : (c, 3) float32
            Of inclined surfaces.
        along, up : (c, m) float32 in [0, 1)
            Uniform numbers.

        Returns
        -------
        (c, m, 3) float32
        """
        # Azimuth: the sine is even, so the cosine from the normal is its density (n · d_h).
        # Elevation: even over the height of the band in front of the surface.
        horizontal = np.hypot(normal[:, 0], normal[:, 1])[:, None]
        level = normal[:, :2] / horizontal
        sine = 2 * along - 1  # of the azimuth from the normal, whose cosine is the density
        cosine = np.sqrt(np.maximum(1 - sine**2, 0))
        elevation = up * _visible_height(-normal[:, 2:] / horizontal, cosine)
        # Turned from the surface's own azimuth to east and north.
        directions = np.empty((*along.shape, 3), np.float32)
        directions[..., 0] = np.cos(elevation) * (cosine * level[:, :1] - sine * level[:, 1:])
        directions[..., 1] = np.cos(elevation) * (cosine * level[:, 1:] + sine * level[:, :1])
        directions[..., 2] = np.sin(elevation)
        return directions

    def weigh(self, normal, towards):
        """What light from the band counts on a surface, so that the band is weighed like a line at
        the horizon.

        Parameters
        ----------
        normal : (m, 3) float
        towards : (m, 3) float
            Towards places of the band, in front of the surfaces.

        Returns
        -------
        (m,) float64
            n · d_h · cos e / (n · d), over the share of the band that is in front; 1 for walls, 0
            for level surfaces.
        """
        # level  horizontal part of the normal, n_h; met  n · d, the cosine of incidence [–].
        normal, towards = np.asarray(normal, float), np.asarray(towards, float)
        level = np.hypot(normal[:, 0], normal[:, 1])
        cos_elevation = np.hypot(towards[:, 0], towards[:, 1])
        faced = np.maximum(np.einsum("ij,ij->i", normal[:, :2], towards[:, :2]), 0)  # n · d_h cos e
        met = np.maximum(np.einsum("ij,ij->i", normal, towards), 1e-9)
        # The share of the band's height that is in front of a surface that leans forward, at this
        # azimuth.
        slope = np.divide(-normal[:, 2], level, out=np.zeros(len(level)), where=level > 0)
        cosine = np.divide(faced, level * cos_elevation, out=np.zeros(len(level)), where=level > 0)
        share = _visible_height(slope, cosine) / HEIGHT
        return np.divide(faced, met * share, out=np.zeros(len(level)), where=share > 0)

    def enter(self, axis, sign, numbers):
        """Directions of light from the band, inwards from the sides of a box around a scene.

        Parameters
        ----------
        axis, sign : (m,)
            Axis and sign of the inward normal.
        numbers : (m, 2) float64
            Uniform.

        Returns
        -------
        (m, 3) float64
        """
        lid = axis == 2
        # Through the lid all azimuths are equally dense, and elevations as tan e; through sides as
        # cos φ, and evenly.
        turn = 2 * np.pi * numbers[:, 0]
        elevation = np.where(
            lid, np.arccos(np.cos(HEIGHT) ** numbers[:, 1]), HEIGHT * numbers[:, 1]
        )
        across = np.where(lid, np.sin(turn), 2 * numbers[:, 0] - 1)
        along = np.where(lid, np.cos(turn), sign * np.sqrt(np.maximum(1 - across**2, 0)))
        x, y = np.where(axis == 1, across, along), np.where(axis == 1, along, across)
        return np.stack([np.cos(elevation) * x, np.cos(elevation) * y, -np.sin(elevation)], axis=1)

    def seen(self, normal, terrain):
        """Share of the band's light on unobstructed surfaces that comes from above distant terrain.

        Parameters
        ----------
        normal : (n, 3) float
        terrain : TerrainHorizon or None

        Returns
        -------
        (n,) float64
            Weighed as the band is, with the cosine of the azimuth from the normal; 1 for level
            surfaces.
        """
        normal = np.asarray(normal, float)
        if terrain is None or not len(normal):
            return np.ones(len(normal))
        return by_normal(lambda some: _share_above(some, terrain), normal, 6)


HORIZON = HorizonBand()
SOURCES = {HORIZON.name: HORIZON}  # traced parts of the sky by their names in files


def _visible_height(slope, cosine):
    """Height of the band in front of a surface's own plane: [rad], at most HEIGHT.

    Parameters
    ----------
    slope : (...) float
        How far the surface leans forward: minus its upward over its horizontal part.
    cosine : (...) float
        Of the azimuth from its normal, not negative.
    """
    # In front where n_h cos φ cos e + n_z sin e > 0: all of it where the surface leans backward,
    # past π/2.
    return np.minimum(np.arctan2(cosine, slope), HEIGHT).astype(np.float32)


def by_normal(function, normal, decimals, *, chunk=512):
    """Values of a function of normals, (n, 3), found once for each of those that differ: (n,)."""
    # Many surfaces share a normal, as walls and roofs of a city do: each is computed once.
    unique, which = np.unique(np.round(normal, decimals) + 0.0, axis=0, return_inverse=True)
    # `chunk`: normals at a time.
    values = [function(unique[first : first + chunk]) for first in range(0, len(unique), chunk)]
    return np.concatenate([*values, np.zeros(0)])[which.ravel()]


def _share_above(normal, terrain):
    """`HorizonBand.seen` of some surfaces behind terrain."""
    # faced  n · d_h for each azimuth, weight of the band there; 0 behind the surface.
    turn, height = np.radians(terrain.azimuth), np.radians(terrain.elevation)
    level = np.hypot(normal[:, 0], normal[:, 1])[:, None]
    faced = np.maximum(normal[:, :1] * np.sin(turn) + normal[:, 1:2] * np.cos(turn), 0)
    inclined = level > 0
    cosine = np.divide(faced, level, out=np.zeros(faced.shape), where=inclined)
    # At each azimuth terrain hides the lower part of the band that is in front of the surface.
    slope = np.divide(-normal[:, 2:], level, out=np.zeros(level.shape), where=inclined)
    band = np.maximum(_visible_height(slope, cosine).astype(float), 1e-9)
    whole = faced.sum(axis=1)
    seen = (faced * np.clip(1 - height / band, 0, 1)).sum(axis=1)
    return np.divide(seen, whole, out=np.ones(len(normal)), where=whole > 0)
