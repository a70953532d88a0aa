;; Robots that drive to places and inspect them.

(define (domain two-robots)
  (:requirements :strips :typing)
  (:types robot place)

  (:constants
    robot1 robot2 - robot
    dock1 dock2 kitchen office lab store - place)

  (:predicates
    (at ?r - robot ?p - place)
    (inspected ?p - place))

  (:action move
    :parameters (?r - robot ?from - place ?to - place)
    :precondition (at ?r ?from)
    :effect (and (not (at ?r ?from))
                 (at ?r ?to)))

  (:action inspect
    :parameters (?r - robot ?p - place)
    :precondition (at ?r ?p)
    :effect (inspected ?p)))
