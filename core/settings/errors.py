"""The one error a user can cause: input that cannot be used."""


class InputError(ValueError):
    """Input that cannot be used.

    Parameters
    ----------
    source : str or path-like
        The file (or option) that is at fault.
    problem : str
        What is wrong and where in it.
    cure : str
        What the user can do about it.
    """

    def __init__(self, source, problem, cure):
        super().__init__(f"{source}: {problem}; {cure}")
        self.source, self.problem, self.cure = str(source), problem, cure

    def __reduce__(self):
        return type(self), (self.source, self.problem, self.cure)
