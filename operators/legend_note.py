"""What has to be read beside the colours of a legend."""

from .attributes import PREFIX, RESULTS

MOMENT = PREFIX + "moment"  # of the timeline, as text
NOTES = {"energy": PREFIX + "weather", "timeline": MOMENT}  # property of the city, by owner of the attribute


def note_of(city, attribute):
    """Weather or moment that an attribute belongs to, as text; "" for attributes that depend on neither."""
    owner = RESULTS[attribute].owner if attribute in RESULTS else ""
    return city.get(NOTES.get(owner, ""), "") if owner in NOTES else ""
