;;; Locks beyond the core: waiting for a lock, locks of stopped robots, lost locks.

(defrule tap-locked
  "The operator lock requires that the tap is not locked: assert that it is locked while a robot has it. The
   saliences of this rule and the next are above that of the rule which starts an action lock."
  (declare (salience ?*SALIENCE-HIGH*))
  (mutex (name tap) (state LOCKED))
  (not (domain-fact (name locked) (param-values tap)))
  =>
  (assert (domain-fact (name locked) (param-values tap))))

(defrule tap-open
  (declare (salience ?*SALIENCE-HIGH*))
  (mutex (name tap) (state OPEN))
  ?fact <- (domain-fact (name locked) (param-values tap))
  =>
  (retract ?fact))

(defrule tap-try-again
  "The other robot was faster: the action waits again. The salience is above that of the core's rule that
   makes an action FAILED."
  (declare (salience (+ ?*SALIENCE-DOMAIN-APPLY* 1)))
  ?action <- (plan-action (action-name lock) (state EXECUTION-FAILED))
  =>
  (modify ?action (state FORMULATED)))

(defrule tap-release
  "Release the tap if this robot does not need it, e.g. because the goal has failed."
  (wm-fact (id "/cx/identity") (value ?me))
  (mutex (name tap) (state LOCKED) (locked-by ?me) (request NONE))
  (not (goal (class CLEAN) (mode DISPATCHED)))
  =>
  (mutex-unlock-async tap))

(defrule tap-released
  "Clear the answer to tap-release; an action `unlock` clears its answer itself."
  ?mutex <- (mutex (name tap) (request UNLOCK) (response UNLOCKED|ERROR))
  (not (plan-action (action-name unlock) (state RUNNING)))
  =>
  (modify ?mutex (request NONE) (response NONE)))

; *** Locks of stopped robots ***

(defrule locks-expire
  "While the other robot has a lock, check once a second whether its locks are too old."
  (time $?now)
  (wm-fact (id "/cx/identity") (value ?me))
  (goal (class HOUSE) (mode DISPATCHED))
  (exists (mutex (state LOCKED) (locked-by ~?me)))
  ?looked <- (looked-for-old-locks $?last)
  (test (timeout ?now ?last 1.0))
  (not (mutex-expire-task))
  =>
  (retract ?looked)
  (assert (looked-for-old-locks ?now))
  (mutex-expire-locks-async))

(defrule locks-expire-done
  ?task <- (mutex-expire-task (task EXPIRE) (state COMPLETED|FAILED))
  =>
  (retract ?task))

; *** Lost locks ***

(defrule lock-of-room-lost
  "The lock has expired: fail the goal, which then has no resource to release."
  ?goal <- (goal (id ?id) (class CLEAN) (mode COMMITTED|DISPATCHED) (params room ?room)
                 (acquired-resources ?room))
  (room (name ?room) (mutex ?name))
  (wm-fact (id "/cx/identity") (value ?me))
  (or (mutex (name ?name) (state OPEN))
      (mutex (name ?name) (state LOCKED) (locked-by ~?me)))
  =>
  (printout warn "The lock of " ?room " is lost" crlf)
  (delayed-do-for-all-facts ((?request resource-request)) (eq ?request:goal ?id)
    (retract ?request))
  (plan-retract-all-for-goal ?id)
  (modify ?goal (mode FINISHED) (outcome FAILED) (acquired-resources) (message "The lock is lost")))

(defrule lock-of-tap-lost
  "The lock has expired while the robot needs it: fail the goal."
  ?goal <- (goal (id ?id) (class CLEAN) (mode DISPATCHED))
  (plan-action (goal-id ?id) (action-name fill) (state PENDING|WAITING|RUNNING))
  (wm-fact (id "/cx/identity") (value ?me))
  (or (mutex (name tap) (state OPEN))
      (mutex (name tap) (state LOCKED) (locked-by ~?me)))
  =>
  (printout warn "The lock of the tap is lost" crlf)
  (plan-retract-all-for-goal ?id)
  (modify ?goal (mode FINISHED) (outcome FAILED) (message "The lock is lost")))
