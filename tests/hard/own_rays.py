"""A second caster: what points of a scene see, with normals, directions and judgement of its own.

Nothing of the tracer is used but the distance at which rays start (below it two faces are one).
Hits come from Embree called directly, whose town tests/core/test_town.py holds against another
program.
"""

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

SKY, FAR, FRONT, BACK, INSIDE = range(5)
TOUCHING = 0.01  # [m]
TURNS = 500


class OwnRays:
    """Triangles of a scene, their own normals and areas, and a tree over them."""

    def __init__(self, scene, offset):
        self.corners = np.asarray(scene.vertices, float)[scene.triangles]
        doubled = np.cross(
            self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0]
        )
        length = np.linalg.norm(doubled, axis=1)
        self.area, self.normal = length / 2, doubled / np.maximum(length, 1e-30)[:, None]
        self.footprint, self.offset = scene.footprint, np.asarray(offset, float)
        self.tree = EmbreeScene(robust=True)
        TriangleMesh(self.tree, scene.vertices.astype(np.float32), scene.triangles.astype(np.int32))

    def points(self, rows, count, generator):
        """Uniform points just in front of some triangles: (n, count, 3)."""
        root, other = (
            np.sqrt(generator.random((len(rows), count))),
            generator.random((len(rows), count)),
        )
        weights = np.stack([1 - root, root * (1 - other), root * other], axis=-1)
        away = self.offset[rows, None, None] * self.normal[rows, None]
        return np.einsum("nkb,nbc->nkc", weights, self.corners[rows]) + away

    def directions(self, rows, count, generator):
        """Cosine-distributed directions: a unit vector on the sphere added to the normal: (n,
        count, 3).
        """
        ball = generator.normal(size=(len(rows), count, 3))
        towards = self.normal[rows, None] + (1 - 1e-7) * ball / np.linalg.norm(
            ball, axis=-1, keepdims=True
        )
        return towards / np.linalg.norm(towards, axis=-1, keepdims=True)

    def judge(self, origins, directions):
        """What each ray meets: sky, far ground, the front of a face, or a back: (n,) int."""
        origins, directions = (
            np.ascontiguousarray(rays, np.float32) for rays in (origins, directions)
        )
        return self.judge_hits(self.tree.run(origins, directions), directions)

    def judge_hits(self, hit, directions):
        """Whoever looks along a face's normal sees its back; of a footprint only backs are seen."""
        back = ((directions * self.normal[hit]).sum(axis=1) > 0) | self.footprint[hit]
        return np.where(
            hit >= 0, np.where(back, BACK, FRONT), np.where(directions[:, 2] > 0, SKY, FAR)
        )

    def shares(self, rows, points, rays, generator, *, inside=False):
        """Shares of the rays from each of some points that meet sky, far ground, fronts and backs,
        and, if wanted, whether the point lies inside something: (n, points, 5)."""
        found = np.zeros((len(rows), points, 5))
        step = max(1, (1 << 18) // (points * rays))
        for first in range(0, len(rows), step):
            some = rows[first : first + step]
            origins = np.repeat(self.points(some, points, generator), rays, axis=1).reshape(-1, 3)
            met = self.judge(
                origins, self.directions(some, points * rays, generator).reshape(-1, 3)
            )
            met = met.reshape(len(some), points, rays)
            share = np.stack([(met == kind).mean(axis=2) for kind in range(4)], axis=-1)
            found[first : first + step, :, :INSIDE] = share
            if inside:
                dark = np.nonzero(share[..., SKY] == 0)
                places = origins.reshape(*met.shape, 3)[:, :, 0][dark]
                found[first : first + step, :, INSIDE][dark] = self.lie_inside(
                    some[dark[0]], places, generator
                )
        return found

    def lie_inside(self, rows, places, generator, rays=8):
        """Whether most rays that go on from fronts, from 1 cm ahead where another face is closer,
        end at backs, and few in the sky, or none leaves at all: (m,) bool of points of triangles,
        (m, 3)."""
        ahead = self.normal[rows]
        hit = self.tree.run(places.astype(np.float32), ahead.astype(np.float32))
        along = (self.normal[hit] * ahead).sum(axis=1)
        distance = ((self.corners[hit, 0] - places) * self.normal[hit]).sum(axis=1) / np.where(
            along < 0, along, -1
        )
        closest = TOUCHING * np.minimum(1, np.sqrt(self.area[rows]))
        close = (hit >= 0) & (along < -0.9) & (distance < closest)
        row, path = np.repeat(rows, rays), np.arange(rays * len(rows))
        origins = np.repeat(places + TOUCHING * close[:, None] * ahead, rays, axis=0)
        towards, ends = self.directions(row, 1, generator)[:, 0], np.full(len(row), FRONT)
        for _ in range(TURNS):
            origins, towards = (
                np.ascontiguousarray(part, np.float32) for part in (origins, towards)
            )
            hit = self.tree.run(origins, towards)
            ends[path] = self.judge_hits(hit, towards)
            going = ends[path] == FRONT
            path = path[going]
            if not len(path):
                break
            origins, towards, _ = self.go_on(
                hit[going], origins[going].astype(float), towards[going], generator
            )
        ends = ends.reshape(-1, rays)
        most, few = (ends == BACK).mean(axis=1) > 0.5, (ends == SKY).mean(axis=1) <= 1 / 8
        return (most & few) | ((ends == BACK) | (ends == FRONT)).all(axis=1)

    def go_on(self, hit, origins, towards, generator):
        """Where rays leave the faces that they meet, to where, and the normal on the side that they
        come from.
        """
        normal, corner = self.normal[hit], self.corners[hit, 0]
        along = (towards * normal).sum(axis=1)
        origins += (((corner - origins) * normal).sum(axis=1) / along)[:, None] * towards
        normal *= -np.sign(along)[:, None]
        origins += self.offset[hit, None] * normal
        ball = generator.normal(size=(len(hit), 3))
        towards = normal + (1 - 1e-7) * ball / np.linalg.norm(ball, axis=1, keepdims=True)
        return origins, towards / np.linalg.norm(towards, axis=1, keepdims=True), normal

    def light(self, rows, count, generator, *, bounces, albedo=0.25, sheet=(), suns=None):
        """Light of the isotropic sky, and of suns, on some triangles together, path by path: mean
        and standard error, two (2,).

        Rays go on from the place that they meet; there suns are looked for. Surfaces in `sheet`
        have two fronts. The far ground is lit without obstruction and reflects as everything else
        does.
        """
        row = generator.choice(rows, count, p=self.area[rows] / self.area[rows].sum())
        origins, normal = self.points(row, 1, generator)[:, 0], self.normal[row]
        towards, found = self.directions(row, 1, generator)[:, 0], np.zeros((count, 2))
        path = np.arange(count)
        for bounce in range(bounces + 1):
            found[path, 1] += albedo**bounce * self.sunlight(origins, normal, suns)
            origins, towards = (
                np.ascontiguousarray(rays, np.float32) for rays in (origins, towards)
            )
            hit = self.tree.run(origins, towards)
            met = self.judge_hits(hit, towards)
            met[np.isin(hit, sheet) & (hit >= 0)] = FRONT
            found[path[met == SKY], 0] += albedo**bounce
            if bounce < bounces:
                lit = [1, suns.weight @ suns.direction[:, 2] if suns else 0]
                found[path[met == FAR]] += albedo ** (bounce + 1) * np.array(lit)
            going = met == FRONT
            path, hit = path[going], hit[going]
            origins, towards, normal = self.go_on(
                hit, origins[going].astype(float), towards[going], generator
            )
        return found.mean(axis=0), found.std(axis=0) / np.sqrt(count)

    def sunlight(self, origins, normal, suns):
        """What places receive of suns by their weights: (n,)."""
        received = np.zeros(len(origins))
        for direction, weight in zip(suns.direction, suns.weight, strict=True) if suns else ():
            met = self.judge(origins, np.broadcast_to(direction, origins.shape))
            received += weight * np.where(met == SKY, np.maximum(normal @ direction, 0), 0)
        return received

    def lit(self, rows, points, sun, generator):
        """Share of each triangle's points whose ray towards a sun meets nothing: (n,)."""
        origins = self.points(rows, points, generator).reshape(-1, 3)
        met = self.judge(origins, np.broadcast_to(sun, origins.shape))
        return (
            (met == SKY).reshape(len(rows), points) & (self.normal[rows] @ sun > 0)[:, None]
        ).mean(axis=1)
