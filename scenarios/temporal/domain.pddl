;; Cooks who do one thing at a time. A raw dish must be prepared before it is served.

(define (domain breakfast)
  (:requirements :strips :typing :durative-actions)

  (:types cook dish)

  (:predicates
    (free ?c - cook)
    (raw ?d - dish)
    (ready ?d - dish)
    (served ?d - dish))

  (:durative-action prepare
    :parameters (?cook - cook ?dish - dish)
    :duration (= ?duration 4)
    :condition (and (at start (free ?cook)) (at start (raw ?dish)))
    :effect (and (at start (not (free ?cook))) (at start (not (raw ?dish)))
                 (at end (free ?cook)) (at end (ready ?dish))))

  (:durative-action serve
    :parameters (?cook - cook ?dish - dish)
    :duration (= ?duration 2)
    :condition (and (at start (free ?cook)) (at start (ready ?dish)))
    :effect (and (at start (not (free ?cook)))
                 (at end (free ?cook)) (at end (served ?dish)))))
