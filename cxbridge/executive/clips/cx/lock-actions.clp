; Executors of the actions lock and unlock (parameter `name`: a mutex),
; flush-locks and expire-locks (no parameters).
;
; Needs plan.clp, coordination-mutex.clp. The rules have Fawkes' names.

(deffunction lock-action-reset-mutex (?mutex)
  "Internal. Reset the mutex after the response to the request of an action."
  (modify ?mutex (request NONE) (response NONE) (error-msg ""))
)

; *** lock ***

(defrule lock-actions-lock-start
  "The action fails at once if the mutex is locked or has a pending request."
  ?action <- (plan-action (action-name lock) (state PENDING) (executable TRUE)
                          (param-names $?names) (param-values $?values))
  =>
  (bind ?name (plan-action-arg name ?names ?values))
  (if (any-factp ((?mutex mutex)) (and (eq ?name ?mutex:name)
                                       (or (eq LOCKED ?mutex:state) (neq NONE ?mutex:request))))
   then
    (modify ?action (state EXECUTION-FAILED))
   else
    (modify ?action (state RUNNING))
    (mutex-try-lock-async ?name))
)

(defrule lock-actions-lock-acquired
  ?action <- (plan-action (action-name lock) (state RUNNING)
                          (param-names $?names) (param-values $?values))
  ?mutex <- (mutex (name ?name&:(eq ?name (plan-action-arg name ?names ?values)))
                   (request LOCK) (response ACQUIRED))
  =>
  (lock-action-reset-mutex ?mutex)
  (modify ?action (state EXECUTION-SUCCEEDED))
)

(defrule lock-actions-lock-rejected
  ?action <- (plan-action (action-name lock) (state RUNNING)
                          (param-names $?names) (param-values $?values))
  ?mutex <- (mutex (name ?name&:(eq ?name (plan-action-arg name ?names ?values)))
                   (request LOCK) (response REJECTED|ERROR) (error-msg ?message))
  =>
  (lock-action-reset-mutex ?mutex)
  (modify ?action (state EXECUTION-FAILED) (error-msg ?message))
)

; *** unlock: the action stays RUNNING if the request fails, as in Fawkes ***

(defrule lock-actions-unlock-start
  ?action <- (plan-action (action-name unlock) (state PENDING) (executable TRUE)
                          (param-names $?names) (param-values $?values))
  =>
  (modify ?action (state RUNNING))
  (mutex-unlock-async (plan-action-arg name ?names ?values))
)

(defrule lock-actions-unlock-done
  ?action <- (plan-action (action-name unlock) (state RUNNING)
                          (param-names $?names) (param-values $?values))
  ?mutex <- (mutex (name ?name&:(eq ?name (plan-action-arg name ?names ?values)))
                   (state OPEN) (request UNLOCK))
  =>
  (lock-action-reset-mutex ?mutex)
  (modify ?action (state EXECUTION-SUCCEEDED))
)

; *** flush-locks ***

(defrule lock-actions-flush-locks-start
  ?action <- (plan-action (action-name flush-locks) (state PENDING) (executable TRUE))
  =>
  (modify ?action (state RUNNING))
  (mutex-flush-locks-async)
)

(defrule lock-actions-flush-locks-succeeded
  ?task <- (mutex-expire-task (task FLUSH) (state COMPLETED))
  ?action <- (plan-action (action-name flush-locks) (state RUNNING))
  =>
  (retract ?task)
  (modify ?action (state EXECUTION-SUCCEEDED))
)

(defrule lock-actions-flush-locks-failed
  ?task <- (mutex-expire-task (task FLUSH) (state FAILED))
  ?action <- (plan-action (action-name flush-locks) (state RUNNING))
  =>
  (retract ?task)
  (modify ?action (state EXECUTION-FAILED))
)

; *** expire-locks ***

(defrule lock-actions-expire-locks-start
  ?action <- (plan-action (action-name expire-locks) (state PENDING) (executable TRUE))
  =>
  (modify ?action (state RUNNING))
  (mutex-expire-locks-async)
)

(defrule lock-actions-expire-locks-succeeded
  ?task <- (mutex-expire-task (task EXPIRE) (state COMPLETED))
  ?action <- (plan-action (action-name expire-locks) (state RUNNING))
  =>
  (retract ?task)
  (modify ?action (state EXECUTION-SUCCEEDED))
)

(defrule lock-actions-expire-locks-failed
  ?task <- (mutex-expire-task (task EXPIRE) (state FAILED))
  ?action <- (plan-action (action-name expire-locks) (state RUNNING))
  =>
  (retract ?task)
  (modify ?action (state EXECUTION-FAILED))
)
