;; The texts that were said to each person. A robot says good bye only to a person whom it has greeted.

(define (domain meeting)
  (:requirements :strips :typing :negative-preconditions)

  (:types name text)

  (:constants HELLO GOODBYE - text)

  (:predicates (said ?n - name ?t - text))  ; sensed, not an assumed effect

  (:action say-goodbye
    :parameters (?name - name)
    :precondition (said ?name HELLO)
    :effect (said ?name GOODBYE))

  (:action say-hello  ; only once to each person
    :parameters (?name - name)
    :precondition (not (said ?name HELLO))
    :effect (said ?name HELLO)))
