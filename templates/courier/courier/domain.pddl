(define (domain courier)
  (:requirements :strips :typing)
  (:types place thing)
  (:predicates (robot-at ?p - place) (at ?t - thing ?p - place) (holding ?t - thing) (hand-free))

  (:action go
    :parameters (?from - place ?to - place)
    :precondition (robot-at ?from)
    :effect (and (not (robot-at ?from)) (robot-at ?to)))

  (:action pick
    :parameters (?thing - thing ?place - place)
    :precondition (and (hand-free) (robot-at ?place) (at ?thing ?place))
    :effect (and (holding ?thing) (not (hand-free)) (not (at ?thing ?place))))

  (:action put
    :parameters (?thing - thing ?place - place)
    :precondition (and (holding ?thing) (robot-at ?place))
    :effect (and (at ?thing ?place) (hand-free) (not (holding ?thing)))))
