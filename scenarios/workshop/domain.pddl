;; Pieces are cut, painted, carried from machine to machine, and handed over for an order.

(define (domain workshop)
  (:requirements :strips :typing :negative-preconditions)
  (:types
    robot place piece wood colour order - object
    machine - place)

  (:constants
    robot1 robot2 - robot
    dock1 dock2 - place
    saw booth counter - machine
    oak ash - wood
    red blue white - colour)

  (:predicates
    (at ?r - robot ?p - place)
    (holds ?r - robot ?w - piece)
    (loaded ?r - robot)
    (in ?w - piece ?m - machine)
    (occupied ?m - machine)
    (cut ?w - piece ?k - wood)
    (painted ?w - piece ?c - colour)
    (handed-over ?w - piece ?o - order))

  (:action move
    :parameters (?r - robot ?from - place ?to - place)
    :precondition (at ?r ?from)
    :effect (and (not (at ?r ?from))
                 (at ?r ?to)))

  (:action cut
    :parameters (?w - piece ?k - wood)
    :precondition (not (occupied saw))
    :effect (and (cut ?w ?k)
                 (in ?w saw)
                 (occupied saw)))

  (:action paint
    :parameters (?w - piece ?c - colour)
    :precondition (in ?w booth)
    :effect (painted ?w ?c))

  (:action take
    :parameters (?r - robot ?w - piece ?m - machine)
    :precondition (and (at ?r ?m)
                       (in ?w ?m)
                       (not (loaded ?r)))
    :effect (and (holds ?r ?w)
                 (loaded ?r)
                 (not (in ?w ?m))
                 (not (occupied ?m))))

  (:action put
    :parameters (?r - robot ?w - piece ?m - machine)
    :precondition (and (at ?r ?m)
                       (holds ?r ?w)
                       (not (occupied ?m)))
    :effect (and (in ?w ?m)
                 (occupied ?m)
                 (not (holds ?r ?w))
                 (not (loaded ?r))))

  (:action hand-over
    :parameters (?w - piece ?o - order)
    :precondition (in ?w counter)
    :effect (and (handed-over ?w ?o)
                 (not (in ?w counter))
                 (not (occupied counter))))

  ;; removal of the piece of a failed order
  (:action clear
    :parameters (?w - piece ?m - machine)
    :precondition (in ?w ?m)
    :effect (and (not (in ?w ?m))
                 (not (occupied ?m))))

  (:action drop
    :parameters (?r - robot ?w - piece)
    :precondition (holds ?r ?w)
    :effect (and (not (holds ?r ?w))
                 (not (loaded ?r)))))
