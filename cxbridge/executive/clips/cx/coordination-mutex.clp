; Mutual exclusion among robots that share a robot memory.
;
; Each mutex is a mutex fact. (mutex-try-lock-async NAME) requests a lock, and
; (mutex-unlock-async NAME) its release. The request stays in the fact until the
; caller has read the response and sets both slots to NONE.
;
;   request     final response
;   LOCK        ACQUIRED; REJECTED if another robot has the lock; ERROR
;   UNLOCK      UNLOCKED, and state OPEN or LOCKED by another robot; ERROR
;   RENEW-LOCK  ACQUIRED; REJECTED if the lock was lost; ERROR
;
; ERROR means misuse, with the reason in error-msg. A request to unlock an OPEN mutex
; waits for the next event of the mutex, as in Fawkes. A PENDING response forbids
; further requests. The state follows the trigger events of the collection in the
; robot memory; other rules must not set the state.
;
; The locks of this robot are renewed periodically, so that a lock grows old only if its
; robot has stopped renewing it. (mutex-expire-locks-async) releases old locks
; (/config/coordination/mutex: renew-interval, max-age-sec).
;
; Needs cx-identity.clp, worldmodel.clp and the feature robot_memory. The rules except
; mutex-renew-lock-op-cleanup have Fawkes' names, as do the templates, and the functions that are not
; internal.

(defglobal
  ; the collection of mutexes; must be the collection that is configured for the robot memory below
  ; /plugins/robot-memory/coordination
  ?*MUTEX-COLLECTION* = "robmem_coordination.mutex"
)

(deftemplate mutex
  "A mutex: its state in the robot memory, and the request of this robot."
  (slot name (type SYMBOL))
  ; --- the request; as in Fawkes, no rule carries out CREATE or FLUSH-LOCKS
  (slot request
    (type SYMBOL)
    (allowed-values NONE LOCK UNLOCK CREATE FLUSH-LOCKS RENEW-LOCK))
  (slot response
    (type SYMBOL)
    (allowed-values NONE PENDING ACQUIRED REJECTED UNLOCKED ERROR))
  (slot error-msg (type STRING))
  (slot auto-renew (type SYMBOL) (allowed-values TRUE FALSE))
  ; --- the next requests; AUTO-RENEW-PROC marks a periodic renewal
  (multislot pending-requests
    (type SYMBOL)
    (allowed-values NONE UNLOCK AUTO-RENEW-PROC))
  ; --- the state in the robot memory
  (slot state (type SYMBOL) (allowed-values UNKNOWN OPEN LOCKED))
  (slot locked-by (type STRING))
  (multislot lock-time (type INTEGER) (cardinality 2 2))
)

(deftemplate mutex-expire-task
  "The release of all locks (FLUSH) or of old locks (EXPIRE)."
  (slot max-age-sec (type FLOAT))
  (slot task (type SYMBOL) (allowed-values FLUSH EXPIRE))
  (slot state (type SYMBOL) (allowed-values NONE PENDING COMPLETED FAILED))
)

(deftemplate mutex-global-data
  "The registered trigger; the fact exists while the trigger is registered."
  (slot trigger-ptr (type EXTERNAL-ADDRESS))
)

; *** Requests ***

(deffunction mutex-error (?mutex ?request ?response $?message-parts)
  "Internal. Respond to a request at once. The message is the concatenation of ?message-parts."
  (modify ?mutex (request ?request) (response ?response)
             (error-msg (str-cat (expand$ ?message-parts))))
)

(deffunction mutex-busy-error (?mutex ?name ?request ?pending)
  "Internal. Respond to ?request, made while the request ?pending is pending."
  (mutex-error ?mutex ?request ERROR
               "Mutex " ?name " already has pending " ?pending " request. "
               "This may lead to unpredictable behavior on both sides!")
)

(deffunction mutex-try-lock-async (?name $?opt-auto-renew)
  "Request the lock of the mutex ?name, which is created if it does not exist. The
   request is rejected if the mutex is locked, even by this robot. The slot auto-renew gets
   the optional second argument, or else TRUE; as in Fawkes, no rule reads the slot, and
   all locks are renewed periodically."
  (bind ?auto-renew (if (> (length$ ?opt-auto-renew) 0) then (nth$ 1 ?opt-auto-renew) else TRUE))
  (if (not (any-factp ((?m mutex)) (eq ?name ?m:name))) then
    (assert (mutex (name ?name) (request LOCK) (auto-renew ?auto-renew)))
    (return))
  (do-for-fact ((?m mutex)) (eq ?name ?m:name)
    (if (eq ?m:state LOCKED)
     then (mutex-error ?m LOCK REJECTED "Lock already held by " ?m:locked-by)
     else
      (if (neq ?m:request NONE)
       then (mutex-busy-error ?m ?name LOCK ?m:request)
       else (modify ?m (request LOCK) (response NONE) (error-msg "")
                       (auto-renew ?auto-renew))))
  )
)

(deffunction mutex-unlock-async (?name)
  "Request the release of the mutex ?name, after a running renewal. The lock of
   another robot stays. An unknown mutex counts as unlocked."
  (if (not (any-factp ((?m mutex)) (eq ?name ?m:name))) then
    (assert (mutex (name ?name) (request UNLOCK) (response UNLOCKED)))
    (return))
  (do-for-fact ((?m mutex)) (eq ?name ?m:name)
    (if (and (eq ?m:state LOCKED) (neq ?m:locked-by (cx-identity))) then
      (mutex-error ?m UNLOCK ERROR
                   "Lock held by " ?m:locked-by ". Cannot release foreign lock.")
      (return))
    (if (and (eq ?m:request RENEW-LOCK) (member$ AUTO-RENEW-PROC ?m:pending-requests)) then
      (modify ?m (pending-requests ?m:pending-requests UNLOCK))
      (return))
    (if (neq ?m:request NONE)
     ; Fawkes' message names UNLOCK, whatever request is pending
     then (mutex-busy-error ?m ?name UNLOCK UNLOCK)
     else (modify ?m (request UNLOCK) (response NONE) (error-msg "")))
  )
)

(deffunction mutex-renew-lock-async (?name)
  "Renew this robot's lock of the mutex ?name. An unknown mutex has no lock to renew."
  (do-for-fact ((?m mutex)) (eq ?name ?m:name)
    (if (neq ?m:state LOCKED) then
      (mutex-error ?m RENEW-LOCK ERROR "Mutex " ?name " not LOCKED. Cannot renew.")
      (return))
    (if (neq ?m:locked-by (cx-identity)) then
      (mutex-error ?m RENEW-LOCK ERROR
                   "Lock held by " ?m:locked-by ". Cannot renew foreign lock.")
      (return))
    (if (neq ?m:request NONE)
     then (mutex-busy-error ?m ?name RENEW-LOCK ?m:request)
     else (modify ?m (request RENEW-LOCK) (response NONE) (error-msg "")))
  )
)

(deffunction mutex-start-expire-task (?task ?max-age-sec)
  "Internal. Release all locks older than ?max-age-sec, unless such a task exists already."
  (if (any-factp ((?running mutex-expire-task)) TRUE)
   then (printout error "Mutex lock expiration already running" crlf)
   else (assert (mutex-expire-task (task ?task) (max-age-sec (float ?max-age-sec)))))
)

(deffunction mutex-flush-locks-async ()
  "Release the locks of all robots. The mutex-expire-task has the outcome, and the
   caller retracts it."
  (mutex-start-expire-task FLUSH 0.0)
)

(deffunction mutex-expire-locks-async ()
  "As mutex-flush-locks-async, for locks older than the configured age."
  (do-for-fact ((?age wm-fact)) (eq ?age:id "/config/coordination/mutex/max-age-sec")
    (mutex-start-expire-task EXPIRE ?age:value)
  )
)

(deffunction mutex-create (?name)
  "Create the mutex ?name in the robot memory, whose event asserts the fact."
  (robmem-mutex-create-async (str-cat ?name))
)

; *** The trigger ***

(deffunction mutex-register-trigger ()
  "Register the trigger for the collection of mutexes; the reply is a feedback fact."
  (bind ?everything (bson-create))  ; an empty query matches all documents
  (robmem-trigger-register ?*MUTEX-COLLECTION* ?everything "mutex-trigger")
  (bson-destroy ?everything)
)

(defrule mutex-init
  (executive-init)
  (not (mutex-global-data))
  (not (executive-finalize))
  =>
  (mutex-register-trigger)
)

(defrule mutex-init-register-trigger-done
  ?answer <- (mutex-trigger-register-feedback SUCCESS "mutex-trigger" ?trigger)
  =>
  (printout info "Registered trigger 'mutex-trigger'" crlf)
  (assert (mutex-global-data (trigger-ptr ?trigger)))
  (retract ?answer)
)

(defrule mutex-init-register-trigger-failed
  ?answer <- (mutex-trigger-register-feedback FAIL "mutex-trigger")
  =>
  (retract ?answer)
  (printout warn "Failed to register trigger 'mutex-trigger', retrying" crlf)
  (mutex-register-trigger)
)

(defrule mutex-finalize
  ?data <- (mutex-global-data (trigger-ptr ?trigger))
  (executive-finalize)
  =>
  (retract ?data)
  (robmem-trigger-destroy ?trigger)
)

(deffunction mutex-trigger-set (?mutex ?response ?state ?locked-by ?lock-time)
  "Internal. Set the state of a mutex from the robot memory."
  (modify ?mutex (response ?response) (state ?state)
             (locked-by ?locked-by) (lock-time ?lock-time))
)

(deffunction mutex-trigger-update (?obj)
  "Set a mutex to the state in the event ?obj (the document of a change), and respond to
   its pending request. Release a lock of this robot that this robot has not requested."
  (if (not (bson-has-field ?obj "fullDocument._id")) then (return))
  (bind ?name (sym-cat (bson-get ?obj "fullDocument._id")))
  (bind ?state (if (bson-get ?obj "fullDocument.locked") then LOCKED else OPEN))
  (bind ?locked-by "")
  (bind ?lock-time (create$ 0 0))
  (if (bson-has-field ?obj "fullDocument.locked-by") then
    (bind ?locked-by (bson-get ?obj "fullDocument.locked-by")))
  (if (bson-has-field ?obj "fullDocument.lock-time") then
    (bind ?lock-time (bson-get-time ?obj "fullDocument.lock-time")))
  (if (not (any-factp ((?m mutex)) (eq ?name ?m:name))) then
    (assert (mutex (name ?name) (state ?state)
                   (locked-by ?locked-by) (lock-time ?lock-time)))
    (return))
  (do-for-fact ((?m mutex)) (eq ?name ?m:name)
    (bind ?ours (and (eq ?state LOCKED) (eq ?locked-by (cx-identity))))
    (bind ?wanted (or (eq ?m:request LOCK) (eq ?m:request RENEW-LOCK)))
    (bind ?unasked (and ?ours (not ?wanted) (eq ?m:state OPEN)))
    (bind ?response ?m:response)
    (if (and ?ours ?wanted) then (bind ?response ACQUIRED))
    (if (and (eq ?state OPEN) (eq ?m:request UNLOCK)) then (bind ?response UNLOCKED))
    (mutex-trigger-set ?m ?response ?state ?locked-by ?lock-time)
    (if ?unasked then
      (printout error "Acquired a mutex without a request, releasing the mutex again!" crlf)
      (mutex-unlock-async ?name))
  )
)

(deffunction mutex-trigger-delete (?obj)
  "Open the mutex of a deleted document if the event ?obj has the document. Events of
   MongoDB's change streams do not have deleted documents, so that the mutex stays."
  (if (not (bson-has-field ?obj "fullDocument._id")) then (return))
  (bind ?name (sym-cat (bson-get ?obj "fullDocument._id")))
  (do-for-fact ((?m mutex)) (eq ?name ?m:name)
    (modify ?m (state OPEN) (locked-by ""))
  )
)

(defrule mutex-trigger-event
  "Handle the oldest event, after this robot has a name to compare with the owners of locks."
  (wm-fact (key cx identity))
  ?event <- (robmem-trigger (name "mutex-trigger") (rcvd-at $?time) (ptr ?obj))
  (not (robmem-trigger (name "mutex-trigger") (rcvd-at $?other&:(time> ?time ?other))))
  =>
  (printout debug "Trigger: " (bson-tostring ?obj) crlf)
  (switch (sym-cat (bson-get ?obj "operationType"))
    (case delete then (mutex-trigger-delete ?obj))
    (case insert then (mutex-trigger-update ?obj))
    (case update then (mutex-trigger-update ?obj))
  )
  (retract ?event)
  (bson-destroy ?obj)
)

(defrule mutex-print-error
  (mutex (name ?name) (locked-by ?owner) (request ?request)
         (response REJECTED|ERROR) (error-msg ?message))
  =>
  (printout warn "Mutex " ?name " (request " ?request ", locked by '" ?owner
                 "') reported an error: " ?message crlf)
)

; *** LOCK ***

(defrule mutex-lock-start
  ?mutex <- (mutex (name ?name) (state OPEN|UNKNOWN) (request LOCK) (response NONE))
  (mutex-global-data)
  =>
  (printout t "Requesting lock " ?name crlf)
  (modify ?mutex (response PENDING))
  (robmem-mutex-try-lock-async (str-cat ?name) (cx-identity))
)

(defrule mutex-lock-invalid
  ?mutex <- (mutex (state LOCKED) (locked-by ?owner) (request LOCK) (response NONE))
  =>
  (mutex-error ?mutex LOCK ERROR "Mutex already locked by " ?owner)
)

(defrule mutex-lock-rejected
  "Another robot has acquired the lock."
  ?mutex <- (mutex (state LOCKED) (locked-by ?owner&:(neq ?owner (cx-identity)))
                   (request LOCK) (response PENDING))
  =>
  (mutex-error ?mutex LOCK REJECTED "Lock held by " ?owner)
)

(defrule mutex-lock-op-failed
  "The robot memory has not granted the lock. Most likely another robot has it, and the event with the name
   of that robot has not arrived yet."
  ?answer <- (mutex-op-feedback try-lock-async FAIL ?name)
  ?mutex <- (mutex (name ?name) (request LOCK) (response PENDING))
  =>
  (retract ?answer)
  (modify ?mutex (state LOCKED) (locked-by "unknown")
             (response REJECTED) (error-msg "Lock held by 'unknown'"))
)

(defrule mutex-lock-op-cleanup
  "Drop a response for which no request waits. The event of the mutex reports the success."
  ?answer <- (mutex-op-feedback try-lock-async ? ?name)
  (not (mutex (name ?name) (request LOCK) (response PENDING)))
  =>
  (retract ?answer)
)

; *** UNLOCK ***

(defrule mutex-unlock-start
  ?mutex <- (mutex (name ?name) (state LOCKED) (locked-by ?owner&:(eq ?owner (cx-identity)))
                   (request UNLOCK) (response NONE))
  (mutex-global-data)
  =>
  (printout t "Requesting unlock " ?name crlf)
  (modify ?mutex (response PENDING))
  (robmem-mutex-unlock-async (str-cat ?name) (cx-identity))
)

(defrule mutex-unlock-invalid
  ?mutex <- (mutex (state LOCKED|UNKNOWN) (locked-by ?owner&:(neq ?owner (cx-identity)))
                   (request UNLOCK) (response NONE))
  =>
  (mutex-error ?mutex UNLOCK ERROR "Locked by " ?owner " (and not by us)")
)

(defrule mutex-unlock-succeeded-already-reacquired
  "The mutex was released, and another robot has acquired it already."
  ?mutex <- (mutex (state LOCKED) (locked-by ?owner&:(neq ?owner (cx-identity)))
                   (request UNLOCK) (response PENDING))
  =>
  (modify ?mutex (response UNLOCKED))
)

; *** RENEW-LOCK, on request ***

(defrule mutex-renew-lock-start
  ?mutex <- (mutex (name ?name) (state LOCKED) (locked-by ?owner&:(eq ?owner (cx-identity)))
                   (request RENEW-LOCK) (response NONE))
  (mutex-global-data)
  =>
  (printout debug "Renewing lock " ?name crlf)
  (modify ?mutex (response PENDING))
  (robmem-mutex-renew-lock-async (str-cat ?name) (cx-identity))
)

(defrule mutex-renew-lock-invalid-not-locked
  ?mutex <- (mutex (state OPEN) (request RENEW-LOCK) (response NONE)
                   (pending-requests $?pending&:(not (member$ AUTO-RENEW-PROC ?pending))))
  =>
  (mutex-error ?mutex RENEW-LOCK ERROR "Mutex is not locked")
)

(defrule mutex-renew-lock-invalid-foreign-lock
  ?mutex <- (mutex (state LOCKED) (locked-by ?owner&:(neq ?owner (cx-identity)))
                   (request RENEW-LOCK) (response NONE)
                   (pending-requests $?pending&:(not (member$ AUTO-RENEW-PROC ?pending))))
  =>
  (mutex-error ?mutex RENEW-LOCK ERROR
               "Mutex locked by " ?owner " (not '" (cx-identity) "')")
)

(defrule mutex-renew-lock-op-failed
  ?answer <- (mutex-op-feedback renew-lock-async FAIL ?name)
  ?mutex <- (mutex (name ?name) (request RENEW-LOCK) (response PENDING))
  =>
  (retract ?answer)
  (mutex-error ?mutex RENEW-LOCK REJECTED "Renewing the lock failed")
)

(defrule mutex-renew-lock-op-cleanup
  "Drop a success, because the event of the mutex reports it, and a late failure, which belongs to a
   finished renewal."
  ?answer <- (mutex-op-feedback renew-lock-async ?result ?name)
  (not (and (test (eq ?result FAIL))
            (mutex (name ?name) (request RENEW-LOCK) (response PENDING))))
  =>
  (retract ?answer)
)

; *** RENEW-LOCK, periodically ***

(deffunction mutex-renew-finished (?mutex ?pending-requests)
  "Internal. Continue with the requests made during the renewal."
  (modify ?mutex (request NONE) (response NONE) (pending-requests ?pending-requests))
)

(defrule mutex-lock-auto-renew
  "Checked at each tick (the time fact). Lock times are system times in whole milliseconds, as the robot
   memory stores them, so the present system time counts, not the time fact, which may be simulated."
  ?mutex <- (mutex (name ?name) (state LOCKED) (locked-by ?owner&:(eq ?owner (cx-identity)))
                   (request NONE) (pending-requests) (lock-time $?locked))
  (wm-fact (id "/config/coordination/mutex/renew-interval")
           (type FLOAT|UINT|INT) (value ?interval))
  (time $?)
  (test (timeout (time-trunc-ms (now-systime)) ?locked ?interval))
  =>
  (printout debug "Automatic renewal of lock for mutex " ?name crlf)
  (modify ?mutex (request RENEW-LOCK) (response NONE) (pending-requests AUTO-RENEW-PROC))
)

(defrule mutex-lock-auto-renew-done
  ?mutex <- (mutex (name ?name) (state LOCKED) (request RENEW-LOCK) (response ACQUIRED)
                   (pending-requests AUTO-RENEW-PROC $?pending))
  =>
  (printout debug "Automatic renewal of lock for mutex " ?name " completed" crlf)
  (mutex-renew-finished ?mutex ?pending)
)

(defrule mutex-lock-auto-renew-failed
  ?mutex <- (mutex (name ?name) (state LOCKED) (locked-by ?owner)
                   (request RENEW-LOCK) (response REJECTED)
                   (pending-requests AUTO-RENEW-PROC $?pending))
  =>
  (printout error "Renewing lock for mutex " ?name " failed. LOST LOCK!" crlf)
  ; this robot must not count as the owner any more
  (if (eq ?owner (cx-identity)) then (bind ?owner "lost"))
  (modify ?mutex (locked-by ?owner) (request NONE) (response NONE) (pending-requests ?pending))
)

(defrule mutex-lock-auto-renew-lock-open
  ?mutex <- (mutex (name ?name) (state OPEN) (request RENEW-LOCK)
                   (pending-requests AUTO-RENEW-PROC $?pending))
  =>
  (printout error "Received response to renewal request for " ?name
                  " but lock has expired in the meantime. " crlf)
  (mutex-renew-finished ?mutex ?pending)
)

(defrule mutex-lock-auto-renew-locked-by-other-entity
  ?mutex <- (mutex (name ?name) (state LOCKED) (locked-by ?owner&:(neq ?owner (cx-identity)))
                   (request RENEW-LOCK) (response ~REJECTED)
                   (pending-requests AUTO-RENEW-PROC $?pending))
  =>
  (printout error "Received response to renewal request for " ?name
                  " but lock is locked by " ?owner ". " crlf)
  (mutex-renew-finished ?mutex ?pending)
)

(defrule mutex-run-pending-request
  "Carry out a request made during a renewal."
  ?mutex <- (mutex (name ?name) (request NONE) (pending-requests ?next $?later))
  =>
  (printout t "Run pending request for mutex " ?name ": " ?next crlf)
  (modify ?mutex (request ?next) (response NONE) (pending-requests ?later))
)

; *** Expiry ***

(defrule mutex-expire-locks-start
  ?task <- (mutex-expire-task (task ?kind) (max-age-sec ?age) (state NONE))
  (mutex-global-data)
  =>
  (printout debug ?kind " locks " crlf)
  (modify ?task (state PENDING))
  (robmem-mutex-expire-locks-async ?age)
)

(defrule mutex-expire-locks-succeeded
  ?answer <- (mutex-op-feedback expire-locks-async OK)
  ?task <- (mutex-expire-task (state PENDING))
  =>
  (retract ?answer)
  (modify ?task (state COMPLETED))
)

(defrule mutex-expire-locks-failed
  ?answer <- (mutex-op-feedback expire-locks-async FAIL)
  ?task <- (mutex-expire-task (state PENDING))
  =>
  (retract ?answer)
  (modify ?task (state FAILED))
)
