;; A robot that drives from waypoint to waypoint.

(define (domain waypoints)
  (:requirements :strips :typing)
  (:types robot waypoint)

  (:constants
    tb3 - robot
    wp-init wp1 wp2 wp3 wp4 wp5 wp6 wp-final - waypoint)

  (:predicates
    (at ?r - robot ?w - waypoint)
    (connected ?from - waypoint ?to - waypoint)
    (visited ?w - waypoint))

  (:action move
    :parameters (?r - robot ?from - waypoint ?to - waypoint)
    :precondition (and (at ?r ?from) (connected ?from ?to))
    :effect (and (not (at ?r ?from))
                 (at ?r ?to)
                 (visited ?to))))
