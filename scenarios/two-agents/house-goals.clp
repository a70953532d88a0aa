;;; The goals of a robot: clean the house, one room after the other. A room is a resource, and the robot
;;; with its lock works in it. If both robots want the same room, the slower robot takes the next room.

(defrule house-begin
  "Formulate the goal once, when the Skiller is controlled and the robot memory sends events."
  (domain-facts-loaded)
  (skiller-control (acquired TRUE))
  (mutex-global-data)
  (wm-robmem-sync-initialized)
  (not (house-begun))
  =>
  (wm-robmem-sync-restore)
  (assert (goal (id HOUSE) (class HOUSE) (type MAINTAIN))
          (looked-for-old-locks 0 0)  ; the time of the last look: long ago
          (house-begun)))

(defrule house-advance
  "The goal needs no decisions: advance it to its next mode."
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
  "A candidate for the choice: a room that is not mopped and not locked."
  (room (name ?room) (number ?number) (mutex ?mutex))
  (not (domain-fact (name mopped) (param-values ?room)))
  (not (mutex (name ?mutex) (state LOCKED)))
  =>
  (assert (dirty ?number ?room)))

(defrule room-not-dirty
  "Retract a candidate that is mopped or locked by now. The salience is above that of room-formulate, which
   must not choose this room."
  (declare (salience ?*SALIENCE-HIGH*))
  ?dirty <- (dirty ? ?room)
  (room (name ?room) (mutex ?mutex))
  (or (domain-fact (name mopped) (param-values ?room))
      (mutex (name ?mutex) (state LOCKED)))
  =>
  (retract ?dirty))

(defrule room-formulate
  "Choose the dirty room with the smallest number, after all candidates are known."
  (declare (salience ?*SALIENCE-LOW*))
  (goal (class HOUSE) (mode DISPATCHED))
  (not (goal (class CLEAN)))
  (dirty ?number ?room)
  (not (dirty ?smaller&:(< ?smaller ?number) ?))
  =>
  (assert (goal (id (sym-cat CLEAN- ?room)) (class CLEAN) (parent HOUSE)
                (params room ?room) (required-resources ?room))))

(defrule room-read-state
  "This robot has the lock, so the other robot does not change the room. Read the state: events may be late."
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

(defrule room-release
  "Release the room when the robot memory has the room's new state; checked in each loop, by the time fact."
  ?goal <- (goal (class CLEAN) (mode EVALUATED) (params room ?room))
  (time $?)
  =>
  (if (house-share ?room) then
    (modify ?goal (mode RETRACTED))))
