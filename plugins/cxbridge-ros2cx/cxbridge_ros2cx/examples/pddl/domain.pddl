; A robot goes from room to room through doors.
(define (domain rooms)
  (:requirements :strips :typing)
  (:types room)
  (:predicates (at ?where - room) (door ?from ?to - room))
  (:action go
    :parameters (?from ?to - room)
    :precondition (and (at ?from) (door ?from ?to))
    :effect (and (not (at ?from)) (at ?to))))
