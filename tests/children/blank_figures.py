"""Figures without content, for tests that look at no picture: drawing would be most of their time."""


def blanks(figure):
    """Return the methods of Matplotlib's `Figure` by name, as they are where nobody looks at pictures."""
    save = figure.savefig

    def savefig(_, *given, **options):
        return save(figure((1, 1)), *given, **options)

    return {"savefig": savefig, "draw_without_rendering": lambda _: None}
