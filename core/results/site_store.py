"""What a solar map is made of, on disk while it is made: memory does not grow with the city.

Surfaces are kept by the square in which the middle of their building lies.
"""

import json
import pickle
import re
import sqlite3
import zlib

import numpy as np

from ..city.building_facts import FACTS
from ..settings.errors import InputError
from .tile_tree import SIDE
from .words import plain


class Store:
    """Surfaces by square, and buildings, in a file of their own."""

    def __init__(self, path):
        self.filled = set()  # columns of the table of buildings that hold anything
        self.addresses = []  # of the first thousand buildings that have one
        self.base = sqlite3.connect(path, isolation_level=None)
        self.base.executescript(
            """PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; BEGIN;
            CREATE TABLE building (number INTEGER PRIMARY KEY, name TEXT UNIQUE, folder INTEGER, x INTEGER, y INTEGER,
                energy REAL, row TEXT, page TEXT);
            CREATE TABLE entry (sorted BLOB, key TEXT, number INTEGER);
            CREATE TABLE told (name TEXT PRIMARY KEY, told TEXT);
            CREATE TABLE piece (x INTEGER, y INTEGER, data BLOB); CREATE INDEX squares ON piece (x, y);"""
        )

    def add_piece(self, piece, number, folder):
        """Store the surfaces of a piece of result folder `number`, by square; return the surfaces
        of buildings with shapes, as a piece whose column `building` numbers buildings from 0.

        Buildings without shapes are left out; surfaces without, such as racks, stay with their
        building.

        Raises
        ------
        InputError
            Another folder has one of its buildings.
        """
        # Where each building is: the square that the mean of all corners of its surfaces lies in.
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
        # New buildings with shapes get a number and their square; those that an earlier piece
        # brought keep theirs. One that another folder has already cannot be told apart, and is
        # refused.
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

    def keep_texts(self, table):
        """Keep what buildings.csv says of some buildings: a pandas.DataFrame by building_id."""
        rows = zip(table.index, table.to_dict("records"), strict=True)
        self.base.executemany(
            "INSERT OR IGNORE INTO told VALUES (?, ?)",
            ((name, json.dumps(values)) for name, values in rows),
        )

    def texts_of(self, name):
        """What was kept of a building: dict, empty where nothing was."""
        told = self.base.execute("SELECT told FROM told WHERE name = ?", (name,)).fetchone()
        return json.loads(told[0]) if told else {}

    def describe_buildings(self, rows):
        """Keep what the index says of buildings: (id or None, number, box, parts, part of flat
        roofs, MWh, kWp, texts …) each, and under which texts each is searched.
        """
        for row in rows:
            name, number, _, _, flat, energy, _, *texts = row
            self.filled |= {column for column, text in zip(FACTS, texts, strict=True) if text}
            self.filled |= {"flatKwp"} if flat and flat[1] else set()
            if texts[0] and len(self.addresses) < 1000:
                self.addresses.append(texts[0])
            self.base.execute(
                "UPDATE building SET row = ?, energy = ? WHERE number = ?",
                (json.dumps(row, separators=(",", ":")), energy, number + 1),
            )
            keys = set() if name is None else search_keys(name, *texts)
            # Texts are compared by a browser as their UTF-16 is.
            self.base.executemany(
                "INSERT INTO entry VALUES (?, ?, ?)",
                ((key.encode("utf-16-be", "replace"), key, number + 1) for key in keys),
            )

    def keep_pages(self, pages):
        """Keep what the pages of buildings say, (name, dict) each; of those that have shapes."""
        self.base.executemany(
            "UPDATE building SET page = ? WHERE name = ?",
            ((json.dumps(page, separators=(",", ":")), name) for name, page in pages),
        )

    def pages(self):
        """What the pages of buildings say, by their number, with their `box`, as JSON: yields str;
        null of those without.
        """
        stored = self.base.execute("SELECT page, row FROM building ORDER BY number")
        for page, row in stored:
            known = page and row and json.loads(page) | {"box": json.loads(row)[2]}
            yield json.dumps(known or None, separators=(",", ":"))

    def entries(self):
        """The index by what is searched: yields key and JSON of an entry."""
        stored = self.base.execute(
            "SELECT key, row FROM entry JOIN building USING (number) ORDER BY sorted, number"
        )
        return ((key, f"[{json.dumps(key)},{row[1:]}") for key, row in stored)

    def largest(self, most):
        """Entries of the buildings with most energy, as JSON, without a key: list of str."""
        stored = self.base.execute(
            "SELECT row FROM building WHERE row NOT NULL ORDER BY energy DESC, number LIMIT ?",
            (most,),
        )
        return [f'["",{row[1:]}' for (row,) in stored]


def search_keys(name, address, *texts):
    """What a building is found by: its id, each of its addresses, its other texts, and the rest of
    each from every word on, of addresses up to the town: set of str, as `words.plain` writes them.
    """
    keys = {plain(name)}
    for text in map(plain, (*address.split("; "), *texts)):
        words = text.partition(", ")[0]
        starts = [match.start() for match in re.finditer(r"(?<![^\W_])[^\W\d_]", words)]
        keys |= {text[start:] for start in (0, *starts) if text}
    return keys
