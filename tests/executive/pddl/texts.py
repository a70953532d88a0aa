"""Domain texts that several tests share."""

from __future__ import annotations

GARDEN = """\
(define (domain garden)
  (:requirements :strips :typing)
  (:types tool plant - object rose - plant) ; two kinds of things
  (:constants can - tool)
  (:predicates (held ?t - tool) (dry ?p - plant))
  (:action pour
    :parameters (?p - plant)
    :precondition (and (held can) (not (or (dry ?p) (= ?p ?p))))
    :effect (and (not (dry ?p)) (held can))
  )
  (:action pick
    :parameters (?t - tool)
    :precondition (held ?t)
    :effect (not (held ?t))
  )
)
"""


def domain(
    action: str,
    *,
    requirements: str = ":strips :typing",
    types: str = "(:types robot place - object dock - place)",
    constants: str = "(:constants home - dock)",
    predicates: str = "(at ?r - robot ?p - place) (free ?p - place) (ready)",
    functions: str = "(:functions (dist ?a ?b - place) - number (total-cost))",
) -> str:
    """Return a domain of one action, whose text starts in line 7."""
    return (
        f"(define (domain test)\n(:requirements {requirements})\n{types}\n{constants}\n"
        f"(:predicates {predicates})\n{functions}\n{action}\n)"
    )


def action(
    condition: str = "(ready)", effect: str = "(ready)", parameters: str = "?r - robot ?p - place"
) -> str:
    """Return the text of an action ``go``, each part on a separate line."""
    return f"(:action go\n:parameters ({parameters})\n:precondition {condition}\n:effect {effect})"
