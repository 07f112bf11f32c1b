"""The devices that people wear in the benchmarks, as parts of a study."""

# The settings of each kind of device that a person wears.
OPERATOR = ["polar_h10", "myo", "shimmer3", "empatica_e4"]


def emulated(kinds: list[str], people: int) -> str:
    """Returns the part of a study that puts each kind of device on each person."""
    tables = (
        f'[[simulate.wearables]]\ntype = "{kind}"\nperson = "p{person:03}"\n'
        for person in range(1, people + 1)
        for kind in kinds
    )
    return '[session]\nname = "emulated"\n' + "".join(tables)
