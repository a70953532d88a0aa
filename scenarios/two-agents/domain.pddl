;; Rooms are swept, then mopped. A robot has water for one room; there is one tap.

(define (domain two-agents)
  (:requirements :strips :typing :negative-preconditions)
  (:types robot room tap - object)

  (:constants
    robot1 robot2 - robot
    bath hall kitchen study - room
    tap - tap)

  (:predicates
    (full ?robot - robot)
    (locked ?name - object)
    (swept ?room - room)
    (mopped ?room - room))

  (:action sweep
    :parameters (?robot - robot ?room - room)
    :precondition (not (swept ?room))
    :effect (swept ?room))

  (:action lock
    :parameters (?name - object)
    :precondition (not (locked ?name))
    :effect (locked ?name))

  (:action fill
    :parameters (?robot - robot)
    :precondition (and (locked tap) (not (full ?robot)))
    :effect (full ?robot))

  (:action unlock
    :parameters (?name - object)
    :precondition (locked ?name)
    :effect (not (locked ?name)))

  (:action mop
    :parameters (?robot - robot ?room - room)
    :precondition (and (full ?robot) (swept ?room) (not (mopped ?room)))
    :effect (and (mopped ?room) (not (full ?robot)))))
