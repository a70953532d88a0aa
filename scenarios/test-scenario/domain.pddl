;; Greeting people, and locks that nobody uses in the plans here.

(define (domain hello-world)
  (:requirements :strips :typing)

  (:types howoften text name)

  (:constants once - howoften
              goodbye hello - text)

  (:predicates
    (locked ?n - name)        ; somebody holds the lock
    (spoken ?h - howoften)    ; we have talked
    (said ?n - name ?t - text))  ; the person was told the text: seen, not assumed

  ;; talking

  (:action say-goodbye  ; only to whom we have greeted
    :parameters (?name - name)
    :precondition (said ?name hello)
    :effect (said ?name goodbye))

  (:action say-hello  ; once a person
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
