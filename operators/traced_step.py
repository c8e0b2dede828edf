"""What the steps that start from a traced city have in common."""

from .keep_transfer import describe_missing, find_kept, has_transfer, reopen_session
from .read_settings import read_settings
from .session import find_city


class OfTransfer:
    """Base of operators that need a city with traced light."""

    @classmethod
    def poll(cls, context):
        """The city has been traced, in this session or before the file was saved."""
        city, _ = find_city(context.scene)
        cls.poll_message_set(describe_missing(city) or "Trace the light first")
        return city is not None and has_transfer(city)

    def prepare(self, context):
        """Take the transfer, or its file, and the settings."""
        city, _ = find_city(context.scene)
        return reopen_session(city), find_kept(city), read_settings(context.scene.citypv)
