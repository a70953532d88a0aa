;; Who was told what. Nobody leaves without having been greeted.

(define (domain meeting)
  (:requirements :strips :typing :negative-preconditions)

  (:types name text)

  (:constants HELLO GOODBYE - text)

  (:predicates (said ?n - name ?t - text))  ; seen, not assumed

  (:action say-goodbye
    :parameters (?name - name)
    :precondition (said ?name HELLO)
    :effect (said ?name GOODBYE))

  (:action say-hello  ; once a person
    :parameters (?name - name)
    :precondition (not (said ?name HELLO))
    :effect (said ?name HELLO)))
