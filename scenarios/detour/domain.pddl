;; Rooms with doors between them. A door may fall shut at any time; no action models this event.

(define (domain rooms)
  (:requirements :strips :typing)

  (:types room)

  (:constants hall office store yard shed - room)

  (:predicates
    (at ?r - room)
    (door ?a ?b - room))  ; an open door

  (:action drive
    :parameters (?from ?to - room)
    :precondition (and (at ?from) (door ?from ?to))
    :effect (and (at ?to) (not (at ?from)))))
