"""Text of a preregistration, in Markdown, from a protocol and its plan."""

from feelahead.study.balance import whole_square
from feelahead.study.protocol import Protocol
from feelahead.study.report.outcomes import outcome_of
from feelahead.study.report.power import ASKED, Plan
from feelahead.study.report.words import models, named, settings_of


def preregistration(protocol: Protocol, planned: Plan | None = None) -> str:
    """Return hypotheses, design, number of participants, outcomes, exclusions and analysis, as plain sentences."""
    sections = (
        ("Hypotheses", _hypotheses(protocol)),
        ("Design", _design(protocol, planned)),
        ("Number of participants", _number(protocol, planned)),
        ("Outcomes", _outcomes(protocol)),
        ("Exclusions", _exclusions(protocol)),
        ("Analysis", [f"- {words}" for words in models(protocol)]),
        ("Not planned", ["What is compared besides these contrasts is called exploratory, and not tested."]),
    )
    head = [
        f"# Preregistration: {protocol.name}",
        "",
        f"Protocol {protocol.hash}. To be filed before the first participant begins.",
    ]
    return "\n".join([*head, *("\n".join(["", f"## {title}", "", *lines]) for title, lines in sections)]) + "\n"


def _hypotheses(protocol: Protocol) -> list[str]:
    lines = []
    for number, one in enumerate(protocol.contrasts, start=1):
        title = outcome_of(one.outcome).title
        lines.append(
            f"{number}. There is a difference in {title} between {one.first} and {one.second}"
            f" (two-sided; family “{one.correct}”)."
        )
    return lines or ["None: the study describes."]


def _design(protocol: Protocol, planned: Plan | None) -> list[str]:
    cells = len(protocol.delays_ms) * len(protocol.scenes) * protocol.trials
    conditions = [f"- {name}: {settings_of(one)}" for name, one in protocol.conditions.items()]
    practice = protocol.practice
    lines = [
        "Within subjects: each participant meets each condition, in blocks.",
        "Conditions stand in the order of a balanced Latin square, whose row is the participant’s number.",
        "Delays are balanced within blocks; scenes and repetitions are drawn by the seed "
        f"{protocol.seed}. Neither participant nor experimenter is told the condition of a trial.",
        "",
        *conditions,
        *([] if planned is None else _enlargements(planned)),
        "",
        f"Delays, one way: {', '.join(f'{delay:g} ms' for delay in protocol.delays_ms)}. "
        f"Scenes: {', '.join(protocol.scenes)}. Repetitions of each cell: {protocol.trials}.",
        f"So {cells} trials a block, {cells * len(protocol.conditions)} a participant, of at most"
        f" {protocol.limit_s:g} s. Controller: {protocol.controller}.",
    ]
    if practice is not None:
        lines.append(
            f"Practice before: scene {practice.scene}, {practice.condition}, until {practice.successes} successes in a"
            f" row, at most {practice.most} tries."
        )
    if protocol.rest is not None:
        lines.append(f"A rest of {protocol.rest.seconds:g} s after every {protocol.rest.trials} trials.")
    return lines


def _enlargements(planned: Plan) -> list[str]:
    means = ", ".join(f"{name} {mean_mm:.1f} mm" for name, mean_mm in planned.enlargements_mm)
    return ["", f"Mean enlargement while a simulated participant's tool moved: {means}."] if means else []


def _number(protocol: Protocol, planned: Plan | None) -> list[str]:
    square = whole_square(protocol)
    lines = [
        f"{protocol.participants} participants. Whoever withdraws is replaced: the new number is above"
        f" {protocol.participants}, and larger than theirs by a multiple of {square}. So the order is the same."
    ]
    if protocol.participants % square:
        lines.append(f"The order of conditions is balanced for multiples of {square}, which this number is not.")
    if planned is None:
        return [*lines, "Power was not estimated."]
    lines += [
        f"Power by {planned.resamples} studies drawn from {planned.pool} simulated participants, at 5 % after Holm’s"
        " correction. Simulated people are no people: the second line of each contrast halves the effect.",
        "",
    ]
    for contrast in dict.fromkeys(row.contrast for row in planned.rows):
        for effect in dict.fromkeys(row.effect for row in planned.rows):
            needed = (planned.smallest(contrast, power, effect) for power in ASKED)
            words = (
                f"{100 * power:.0f} % {'not reached' if one is None else f'from {one} participants'}"
                for power, one in zip(ASKED, needed, strict=True)
            )
            lines.append(f"- {named(contrast)}, {100 * effect:g} % of the simulated effect: {', '.join(words)}.")
    lines += [f"- {named(one)}: simulated participants do not tell." for one in planned.untold]
    return lines


def _outcomes(protocol: Protocol) -> list[str]:
    found = {outcome_of(one.outcome) for one in protocol.contrasts}
    lines = [
        "- " + "; ".join(filter(None, (f"{outcome.title}, {outcome.unit}".rstrip(", "), outcome.caution)))
        for outcome in sorted(found, key=lambda one: one.name)
    ]
    asked = (["NASA-TLX, raw score"] if protocol.tlx else []) + [f"“{item.text}”" for item in protocol.items]
    return [*lines, *([f"- After each block: {'; '.join(asked)}."] if asked else [])]


def _exclusions(protocol: Protocol) -> list[str]:
    kept = "stay in" if protocol.withdrawn == "keep" else "are removed from"
    return [
        "- Trials of practice do not count.",
        "- A trial with a fault of the apparatus is repeated, and the repeated one counts; both are listed.",
        f"- Trials of a participant who withdraws {kept} the data.",
        "- A pair of trials counts if both are complete.",
        "- No trial is excluded for its outcome. Any other exclusion is listed with its reason.",
    ]
