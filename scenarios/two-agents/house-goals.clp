;;; The goals of a robot: the house shall be clean, and for that, one room after the other. A room is a
;;; resource: who has its lock works in it. Both robots want the same room; who is slower takes the next.

(defrule house-begin
  "Once: our Skiller obeys us, and the robot memory tells us what changes."
  (domain-facts-loaded)
  (skiller-control (acquired TRUE))
  (mutex-global-data)
  (wm-robmem-sync-initialized)
  (not (house-begun))
  =>
  (wm-robmem-sync-restore)
  (assert (goal (id HOUSE) (class HOUSE) (type MAINTAIN))
          (looked-for-old-locks 0 0)
          (house-begun)))

(defrule house-goes-on
  "Nothing is to be decided here: it goes from one mode to the next."
  ?goal <- (goal (id ?id) (class HOUSE|CLEAN) (mode ?mode&FORMULATED|SELECTED|EXPANDED))
  =>
  (bind ?modes (create$ FORMULATED SELECTED EXPANDED COMMITTED))
  (modify ?goal (mode (nth$ (+ 1 (member$ ?mode ?modes)) ?modes)) (committed-to (sym-cat ?id -PLAN))))

(defrule house-dispatch
  ?goal <- (goal (class HOUSE) (mode COMMITTED))
  =>
  (modify ?goal (mode DISPATCHED)))

(defrule house-is-clean
  ?goal <- (goal (class HOUSE) (mode DISPATCHED))
  (domain-facts-loaded)
  (forall (room (name ?room)) (domain-fact (name mopped) (param-values ?room)))
  (not (goal (class CLEAN)))
  =>
  (modify ?goal (mode RETRACTED) (outcome COMPLETED)))

; *** Rooms ***

(defrule room-dirty
  "Notes for the choice: a room that is not mopped, and that nobody has locked."
  (room (name ?room) (number ?number) (mutex ?mutex))
  (not (domain-fact (name mopped) (param-values ?room)))
  (not (mutex (name ?mutex) (state LOCKED)))
  =>
  (assert (dirty ?number ?room)))

(defrule room-not-dirty
  (declare (salience ?*SALIENCE-HIGH*))
  ?dirty <- (dirty ? ?room)
  (room (name ?room) (mutex ?mutex))
  (or (domain-fact (name mopped) (param-values ?room))
      (mutex (name ?mutex) (state LOCKED)))
  =>
  (retract ?dirty))

(defrule room-formulate
  (declare (salience ?*SALIENCE-LOW*))
  (goal (class HOUSE) (mode DISPATCHED))
  (not (goal (class CLEAN)))
  (dirty ?number ?room)
  (not (dirty ?smaller&:(< ?smaller ?number) ?))
  =>
  (assert (goal (id (sym-cat CLEAN- ?room)) (class CLEAN) (parent HOUSE)
                (params room ?room) (required-resources ?room))))

(defrule room-look
  "The room is ours: nobody else changes it now. Events may be late, so ask how it is."
  (goal (id ?id) (class CLEAN) (mode COMMITTED) (params room ?room) (acquired-resources ?room))
  (not (room-seen ?id))
  =>
  (wm-robmem-sync-restore)
  (assert (room-seen ?id)))

(defrule room-evaluate
  ?goal <- (goal (id ?id) (class CLEAN) (mode FINISHED))
  =>
  (delayed-do-for-all-facts ((?seen room-seen)) (eq ?seen:implied (create$ ?id))
    (retract ?seen))
  (modify ?goal (mode EVALUATED)))

(defrule room-give-back
  "As soon as the robot memory knows what was done: looked for once a loop."
  ?goal <- (goal (class CLEAN) (mode EVALUATED) (params room ?room))
  (time $?)
  =>
  (if (house-is-shared ?room) then
    (modify ?goal (mode RETRACTED))))
