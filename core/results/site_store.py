"""What a solar map is made of, on disk while it is made: memory does not grow with the city.

Surfaces are kept by the square in which the middle of their building lies.
"""

import json
import pickle
import sqlite3
import zlib

import numpy as np

from ..settings.errors import InputError
from .tile_tree import SIDE


class Store:
    """Surfaces by square, and buildings, in a file of their own."""

    def __init__(self, path):
        self.base = sqlite3.connect(path, isolation_level=None)
        self.base.executescript(
            """PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; BEGIN;
            CREATE TABLE building (number INTEGER PRIMARY KEY, name TEXT UNIQUE, folder INTEGER, x INTEGER, y INTEGER,
                sorted BLOB, energy REAL, row TEXT);
            CREATE TABLE piece (x INTEGER, y INTEGER, data BLOB); CREATE INDEX squares ON piece (x, y);"""
        )

    def add_piece(self, piece, number, folder):
        """Keep the surfaces of a piece of the folder of some number, each with its building; return
        what was kept.

        Buildings without shapes are left out; surfaces without, such as racks, stay with their
        building.

        Raises
        ------
        InputError
            Another folder has one of its buildings.
        """
        # Where each building is: the square that the middle of its corners lies in.
        names, building = np.unique(
            piece.faces["building_id"].to_numpy(object).astype(str), return_inverse=True
        )
        owner = building[piece.shapes.feature]
        count = np.bincount(owner, minlength=len(names))
        sums = np.stack(
            [np.bincount(owner, corners, len(names)) for corners in piece.shapes.corners[:, :2].T],
            axis=1,
        )
        squares = np.floor(sums / np.maximum(count, 1)[:, None] / SIDE).astype(int).tolist()
        # Buildings get numbers; one that another folder has already cannot be told apart.
        add = "INSERT OR IGNORE INTO building (name, folder, x, y) VALUES (?, ?, ?, ?)"
        rows_of_squares = [(name, number, *squares[k]) for k, name in enumerate(names) if count[k]]
        self.base.executemany(add, rows_of_squares)
        find = "SELECT number - 1, x, y, folder FROM building WHERE name = ?"
        known = np.array(
            [self.base.execute(find, (name,)).fetchone() or (0, 0, 0, -1) for name in names]
        )
        if (other := (known[:, 3] >= 0) & (known[:, 3] != number)).any():
            raise InputError(
                folder,
                f"building {names[other][0]} is in another folder too",
                "leave one of them out",
            )
        # Surfaces of buildings that have shapes, sorted into squares, each kept as a packed piece.
        shaped = known[building, 3] >= 0
        piece, building = piece.take(shaped), building[shaped]
        piece.faces = piece.faces.assign(building=known[building, 0])
        square, place = np.unique(known[building, 1:3], axis=0, return_inverse=True)
        for k, (x, y) in enumerate(square.tolist()):
            data = zlib.compress(pickle.dumps(piece.take(place.ravel() == k)), 1)
            self.base.execute("INSERT INTO piece VALUES (?, ?, ?)", (x, y, data))
        piece.faces = piece.faces.reset_index(drop=True)
        return piece

    def pieces(self, square):
        """Pieces of a square: list of Piece."""
        stored = self.base.execute(
            "SELECT data FROM piece WHERE x = ? AND y = ? ORDER BY rowid", square
        )
        return [pickle.loads(zlib.decompress(data)) for (data,) in stored]

    def describe_buildings(self, rows):
        """Keep what the index says of buildings: (number, id or None, box, parts, part of flat
        roofs) each.
        """
        self.base.executemany(
            "UPDATE building SET row = ?, energy = ?, sorted = ? WHERE number = ?",
            [
                # Texts are compared by a browser as their UTF-16 is.
                (
                    json.dumps(row, separators=(",", ":")),
                    sum(part[3] for part in row[3]),
                    key,
                    row[1] + 1,
                )
                for row in rows
                for key in [
                    None if row[0] is None else row[0].lower().encode("utf-16-be", "replace")
                ]
            ],
        )

    def building_rows(self, order, most=-1):
        """Rows of the index as JSON, in the order of a column: yields str."""
        stored = self.base.execute(
            f"SELECT row FROM building ORDER BY {order}, number LIMIT ?", (most,)
        )
        return (row for (row,) in stored)
