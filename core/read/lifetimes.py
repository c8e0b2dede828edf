"""Buildings, parts and trees that no longer stand: files of registers keep them, with the date on
which they ended.
"""

from datetime import date

# words of files
TERMINATION, DEMOLITION = (
    ("terminationDate", "validTo"),
    ("dateOfDemolition", "yearOfDemolition"),
)
# reason why something is left out
GONE = "no longer stands, by its date of demolition or termination"


def read_ends(element):
    """What an element of CityGML tells of its end: dict of word to text."""
    children = ((child.tag.rpartition("}")[2], child.text) for child in element.iterchildren("*"))
    return {word: text for word, text in children if word in (*TERMINATION, *DEMOLITION)}


def is_terminated(given, today=None):
    """Whether a record has ended: by a date of words of a file, that is no later than today.

    Parameters
    ----------
    given : dict of str to object
        Words of the file -> values.
    today : datetime.date, optional
    """
    end = _last_day(given, TERMINATION)
    return end is not None and end <= (today or date.today())


def note_demolitions(given, content):
    """Keep the days of demolition of buildings and parts, where they are told, for
    `leave_out_demolished`.

    Parameters
    ----------
    given : dict of (int, int) to dict
        Building and part -> words of the file and their values.
    content : FileContent
    """
    for place, words in given.items():
        end = _last_day(words, DEMOLITION)
        if end is not None:
            content.demolitions[place] = end


def leave_out_demolished(content, today=None):
    """Leave out buildings and parts of a file that were demolished.

    Days of demolition are lifetimes that somebody assumed, not facts, where the file knows any more
    than ten years ahead: then none is used, and a note says so.

    Parameters
    ----------
    content : FileContent
        Changed in place; references are resolved.
    today : datetime.date, optional
    """
    today, ends = today or date.today(), content.demolitions
    gone = {place for place, end in ends.items() if end <= today}
    if gone and max(ends.values()).year > today.year + 10:
        words = f"{content.path} gives {len(ends)} dates of demolition, some far ahead"
        content.notes.append(
            f"{words}: they are taken for assumed lifetimes, and nothing is left out."
        )
        return
    for building, part in sorted(gone):
        content.skip(
            GONE,
            f"{content.buildings[building] or 'unnamed building'}{f' part {part}' if part else ''}",
        )
    whole = {building for building, part in gone if not part}
    content.polygons = [
        polygon for polygon in content.polygons if (polygon.building, polygon.part) not in gone
    ]
    for place in gone & content.attributes.keys():
        del content.attributes[place]
    content.keep_buildings({k: name for k, name in enumerate(content.buildings) if k not in whole})


def _last_day(given, words):
    """The day that the first date among some words names, the last one of a year alone; None if
    there is no date.
    """
    for word in words:
        text = str(given.get(word) or "").strip()[:10]
        try:
            return date.fromisoformat(text if len(text) == 10 else f"{int(text[:4]):04}-12-31")
        except ValueError:  # not a date
            continue
    return None
