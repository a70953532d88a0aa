;; Robots sweep the rooms in which they are; moves take time.
(define (domain tour)
  (:requirements :strips :typing :negative-preconditions :fluents :durative-actions)
  (:types robot place - object room - place)
  (:constants dock - place)
  (:predicates (at ?r - robot ?p - place) (clean ?p - room) (open))
  (:functions (distance ?a - place ?b - place) (battery ?r - robot))
  (:action sweep
    :parameters (?who - robot ?where - room)
    :precondition (and (at ?who ?where) (not (clean ?where)))
    :effect (clean ?where))
  (:durative-action move
    :parameters (?who - robot ?from - place ?to - place)
    :duration (= ?duration 5)
    :condition (and (at start (at ?who ?from)) (over all (open)))
    :effect (and (at start (not (at ?who ?from))) (at end (at ?who ?to)))))
