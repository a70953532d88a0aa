;; Greeting people, and locks, which the plans of this scenario do not use.

(define (domain hello-world)
  (:requirements :strips :typing)

  (:types howoften text name)

  (:constants once - howoften
              goodbye hello - text)

  (:predicates
    (locked ?n - name)        ; a robot holds the lock
    (spoken ?h - howoften)    ; the robot has talked
    (said ?n - name ?t - text))  ; the text was said to the person: sensed, not an assumed effect

  ;; talking

  (:action say-goodbye  ; only to a person whom the robot has greeted
    :parameters (?name - name)
    :precondition (said ?name hello)
    :effect (said ?name goodbye))

  (:action say-hello  ; only once to each person
    :parameters (?name - name)
    :precondition (not (said ?name hello))
    :effect (and (said ?name hello)
                 (spoken once)))

  (:action say-hello-again
    :parameters (?name - name)
    :precondition (said ?name hello)
    :effect (and (said ?name hello)
                 (not (spoken once))))

  ;; locks

  (:action unlock
    :parameters (?name - name)
    :precondition (locked ?name)
    :effect (and (not (locked ?name))))

  (:action lock
    :parameters (?name - name)
    :precondition (not (locked ?name))
    :effect (and (locked ?name))))
