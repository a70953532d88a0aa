; Locks for the resources of goals: each resource is a mutex named resource-NAME.
;
; A COMMITTED goal acquires all of its required-resources, or is REJECTED if another
; robot or another goal has one of them. The slot acquired-resources lists the resources
; that the goal has acquired so far; the rules of sub-types (goals/*.clp) dispatch a goal when
; the slot lists all of them. A dispatched goal keeps its resources until it is RETRACTED.
;
; Needs goal.clp, coordination-mutex.clp. The rules that acquire, reject and release have
; Fawkes' names.

(deftemplate resource-request
  "A resource that the goal acquires or has acquired."
  (slot goal (type SYMBOL))
  (slot resource (type SYMBOL))
)

(deftemplate resource-need
  "Internal. A goal, a resource that it requires, and the mutex of the resource. Rules
   join this fact with mutexes, because CLIPS looks up a join on a field in a hash table,
   but computes a name such as that of a mutex for each pair of facts."
  (slot goal (type SYMBOL))
  (slot resource (type SYMBOL))
  (slot mutex (type SYMBOL))
)

(deftemplate resource-mutex
  "Internal. A resource that some goal has requested, and its mutex."
  (slot resource (type SYMBOL))
  (slot mutex (type SYMBOL))
)

(deffunction resource-to-mutex (?resource)
  "The name of the mutex of a resource."
  (return (sym-cat resource- ?resource))
)

(deffunction mutex-to-resource (?mutex)
  "The resource of a mutex; FALSE for other mutexes."
  (if (neq 1 (str-index "resource-" ?mutex)) then (return FALSE))
  (bind ?prefix-length (str-length "resource-"))
  (return (sym-cat (sub-string (+ ?prefix-length 1) (str-length ?mutex) ?mutex)))
)

; *** Internal facts for joins ***
; The salience HIGH lets all of these facts exist before the rules below fire.

(defrule resource-locks-assert-need
  (declare (salience ?*SALIENCE-HIGH*))
  (goal (id ?goal) (required-resources $? ?resource $?))
  (not (resource-need (goal ?goal) (resource ?resource)))
  =>
  (assert (resource-need (goal ?goal) (resource ?resource)
                         (mutex (resource-to-mutex ?resource))))
)

(defrule resource-locks-retract-need
  (declare (salience ?*SALIENCE-HIGH*))
  ?need <- (resource-need (goal ?goal) (resource ?resource))
  (not (goal (id ?goal) (required-resources $? ?resource $?)))
  =>
  (retract ?need)
)

(defrule resource-locks-assert-mutex
  (declare (salience ?*SALIENCE-HIGH*))
  (resource-request (resource ?resource))
  =>
  (assert (resource-mutex (resource ?resource) (mutex (resource-to-mutex ?resource))))
)

; *** Acquire ***

(defrule resource-locks-request-lock
  "No required resource of the goal is locked, requested or acquired: request all."
  (goal (id ?goal) (mode COMMITTED) (verbosity ?verbosity)
        (required-resources $?required&~:(= 0 (length$ ?required)))
        (acquired-resources))
  (not (and (resource-need (goal ?goal) (mutex ?name))
            (mutex (name ?name) (state LOCKED))))
  (not (and (resource-need (goal ?goal) (mutex ?name))
            (mutex (name ?name) (request ~NONE))))
  (not (and (resource-need (goal ?goal) (resource ?resource))
            (resource-request (resource ?resource))))
  =>
  (progn$ (?resource ?required)
    (if (neq QUIET ?verbosity) then (printout warn "Locking resource " ?resource crlf))
    (assert (resource-request (resource ?resource) (goal ?goal)))
    (mutex-try-lock-async (resource-to-mutex ?resource))
  )
)

(defrule resource-locks-lock-acquired
  (resource-request (goal ?goal) (resource ?resource))
  (resource-need (goal ?goal) (resource ?resource) (mutex ?name))
  ?mutex <- (mutex (name ?name) (request LOCK) (response ACQUIRED))
  ?goal-fact <- (goal (id ?goal) (mode COMMITTED)
                      (acquired-resources $?acquired&~:(member$ ?resource ?acquired)))
  =>
  (modify ?mutex (request NONE) (response NONE))
  (cx-modify-goal ?goal-fact (acquired-resources ?acquired ?resource))
)

; *** Reject ***

(defrule resource-locks-fast-reject-goal-locked-by-other-agent
  "Another robot has the resource, and the goal has no resources and no requests."
  (wm-fact (key cx identity) (value ?me))
  ?goal-fact <- (goal (id ?goal) (mode COMMITTED) (verbosity ?verbosity) (acquired-resources))
  (resource-need (goal ?goal) (resource ?resource) (mutex ?name))
  (mutex (name ?name) (state LOCKED) (locked-by ?owner&~?me) (request NONE))
  (not (and (resource-request (goal ?goal) (resource ?other))
            (resource-need (goal ?goal) (resource ?other) (mutex ?asked))
            (mutex (name ?asked) (request ~NONE))))
  =>
  (if (neq QUIET ?verbosity) then
    (printout warn "Rejecting goal " ?goal ", " ?resource
                   " is already locked by " ?owner crlf))
  (cx-modify-goal ?goal-fact (mode FINISHED) (outcome REJECTED))
)

(defrule resource-locks-fast-reject-goal-locked-for-another-goal
  "Another goal has the resource, this goal has no resources, and no request for the lock
   is pending."
  ?goal-fact <- (goal (id ?goal) (mode COMMITTED) (verbosity ?verbosity) (acquired-resources))
  (resource-need (goal ?goal) (resource ?resource) (mutex ?name))
  (resource-request (resource ?resource) (goal ?other&~?goal))
  (not (mutex (name ?name) (request ~NONE)))
  =>
  (if (neq QUIET ?verbosity) then
    (printout warn "Rejecting goal " ?goal ", " ?resource
                   " is already locked for " ?other crlf))
  (cx-modify-goal ?goal-fact (mode FINISHED) (outcome REJECTED))
)

(defrule resource-locks-lock-rejected-release-acquired-resources
  "A lock was rejected, and no request is pending: release the acquired resources."
  (resource-request (goal ?goal) (resource ?resource))
  (resource-need (goal ?goal) (resource ?resource) (mutex ?name))
  (mutex (name ?name) (request LOCK) (response REJECTED|ERROR))
  (goal (id ?goal) (mode COMMITTED)
        (acquired-resources $?acquired&~:(member$ ?resource ?acquired)))
  (not (and (resource-need (goal ?goal) (mutex ?pending))
            (mutex (name ?pending) (response PENDING))))
  =>
  (progn$ (?held ?acquired)
    (bind ?held-mutex (resource-to-mutex ?held))
    (if (any-factp ((?m mutex)) (and (eq ?m:name ?held-mutex) (eq ?m:request NONE)))
     then (mutex-unlock-async ?held-mutex))
  )
)

(defrule resource-locks-reject-goal-on-rejected-lock
  "A lock was rejected, the goal has no resources, and no lock that it needs is pending or
   just granted."
  ?goal-fact <- (goal (id ?goal) (mode COMMITTED) (verbosity ?verbosity) (acquired-resources))
  (resource-need (goal ?goal) (resource ?resource) (mutex ?name))
  (mutex (name ?name) (request LOCK) (response REJECTED|ERROR) (error-msg ?message))
  (not (and (resource-need (goal ?goal) (mutex ?undecided))
            (mutex (name ?undecided) (response PENDING|ACQUIRED))))
  =>
  (if (neq QUIET ?verbosity) then
    (printout warn "Rejecting goal " ?goal ", resource lock " ?resource
                   " was rejected" crlf))
  (cx-modify-goal ?goal-fact (mode FINISHED) (outcome REJECTED) (message ?message))
  (delayed-do-for-all-facts ((?request resource-request)) (eq ?goal ?request:goal)
    (bind ?requested-name (resource-to-mutex ?request:resource))
    (do-for-fact ((?mutex mutex)) (eq ?requested-name ?mutex:name)
      (modify ?mutex (request NONE) (response NONE) (error-msg ""))
    )
    (retract ?request)
  )
)

; *** Release ***

(defrule resource-locks-unlock-start
  (goal (mode RETRACTED) (verbosity ?verbosity)
        (acquired-resources $?acquired&~:(= 0 (length$ ?acquired))))
  =>
  (progn$ (?resource ?acquired)
    (bind ?name (resource-to-mutex ?resource))
    (if (not (any-factp ((?m mutex))
                        (and (eq ?name ?m:name)
                             (or (eq UNLOCK ?m:request)
                                 (member$ UNLOCK ?m:pending-requests)))))
     then
      (if (neq QUIET ?verbosity) then
        (printout warn "Unlocking resource " ?resource crlf))
      (mutex-unlock-async ?name))
  )
)

(defrule resource-locks-unlock-done
  ?request <- (resource-request (goal ?goal) (resource ?resource))
  (resource-mutex (resource ?resource) (mutex ?name))
  ?mutex <- (mutex (name ?name) (state OPEN) (request UNLOCK))
  ?goal-fact <- (goal (id ?goal) (acquired-resources $?acquired))
  =>
  (cx-modify-goal ?goal-fact (acquired-resources (delete-member$ ?acquired ?resource)))
  (modify ?mutex (request NONE) (response NONE))
  (retract ?request)
)
