(define (domain hello)
  (:requirements :strips :typing)
  (:types person)
  (:constants ann - person)
  (:predicates
    (greeted ?who - person))
  (:action greet
    :parameters (?who - person)
    :precondition (not (greeted ?who))
    :effect (greeted ?who)))
