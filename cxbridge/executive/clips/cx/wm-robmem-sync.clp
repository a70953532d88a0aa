; Shares parts of the world model with other robots through the robot memory.
;
; Shared are the wm-facts whose key starts with the prefix of a wm-robmem-sync-conf,
; see (wm-robmem-sync-enable ID...), after the wm-fact /cx/identity has the name of
; this agent.
;
; A shared wm-fact is a document: _id (the fact's ID), type, is-list ("TRUE" or
; "FALSE"), value or values, source (the robot that wrote it), update-timestamp.
; A write is an upsert of the document with this _id and no later timestamp. If the
; stored document is later, the database tries to insert a second document with the
; _id and refuses, so that later data are not overwritten.
;
; Changes by other robots arrive as trigger events. A removal that is not later than the
; last known change of the fact is refused; its wm-robmem-sync-map-entry has the time of
; this change even after the retraction of the fact. A written document that is not later
; is refused only while the fact exists, as in Fawkes.
;
; Needs time.clp, worldmodel.clp and the feature robot_memory. Rules and functions have
; Fawkes' names, except internal functions, wm-robmem-sync-fact-modified-in-place and
; wm-robmem-sync-content-cleanup.

(defglobal
  ?*WM-ROBMEM-SYNC-COLLECTION* = "syncedrobmem.worldmodel"
)

(deftemplate wm-robmem-sync-map-entry
  "A shared fact: its index (0: retracted) and the time of its last change."
  (slot wm-fact-idx (type INTEGER))
  (multislot update-timestamp (type INTEGER) (cardinality 2 2))
  (slot wm-fact-id (type STRING))
  (multislot wm-fact-key (type SYMBOL))
)

(deftemplate wm-robmem-sync-content
  "Internal. The content of a shared fact when it was last sent or received. Shows a
   modification that has kept the index of the fact."
  (slot wm-fact-id (type STRING))
  (slot type (type SYMBOL))
  (slot is-list (type SYMBOL))
  (slot value)
  (multislot values)
)

(deftemplate wm-robmem-sync-initialized
  "Exists while the trigger is registered."
  (slot trigger-ptr (type EXTERNAL-ADDRESS))
)

(deftemplate wm-robmem-sync-conf
  "A key prefix whose facts are shared."
  (slot enabled (type SYMBOL) (allowed-values TRUE FALSE))
  (multislot wm-fact-key-prefix (type SYMBOL))
)

(deffunction wm-robmem-sync-enable ($?id-prefixes)
  "Share the facts whose IDs start with one of ?id-prefixes (whole path elements)."
  (progn$ (?id ?id-prefixes)
    (assert (wm-robmem-sync-conf (wm-fact-key-prefix (wm-id-to-key ?id))))
  )
)

(deffunction wm-robmem-sync-now ()
  "Internal. The system time in milliseconds, the resolution of the database."
  (return (time-trunc-ms (now-systime)))
)

; *** The last sent or received state ***

(deffunction wm-robmem-sync-note-content (?wf)
  "Internal. Store the content of the fact."
  (bind ?id (fact-slot-value ?wf id))
  (do-for-fact ((?content wm-robmem-sync-content)) (eq ?id ?content:wm-fact-id)
    (retract ?content)
  )
  (assert (wm-robmem-sync-content (wm-fact-id ?id)
                                  (type (fact-slot-value ?wf type))
                                  (is-list (fact-slot-value ?wf is-list))
                                  (value (fact-slot-value ?wf value))
                                  (values (fact-slot-value ?wf values))))
)

(deffunction wm-robmem-sync-note-entry (?id ?key ?idx ?time)
  "Internal. Store the index and the time of a change."
  ; do-for-fact returns FALSE if there is no such fact
  (if (not (do-for-fact ((?entry wm-robmem-sync-map-entry)) (eq ?id ?entry:wm-fact-id)
             (modify ?entry (wm-fact-idx ?idx) (update-timestamp ?time))
             TRUE))
   then
    (assert (wm-robmem-sync-map-entry (wm-fact-id ?id) (wm-fact-key ?key)
                                      (wm-fact-idx ?idx) (update-timestamp ?time))))
)

; *** Documents ***

(deffunction wm-robmem-sync-create-fact-doc (?wf ?identity ?update-timestamp)
  "A document for a wm-fact, written by the robot ?identity. The caller destroys the
   document."
  (bind ?doc (bson-create))
  (bson-append ?doc "_id" (fact-slot-value ?wf id))
  (bson-append-time ?doc "update-timestamp" ?update-timestamp)
  (bson-append ?doc "source" ?identity)
  (bson-append ?doc "type" (fact-slot-value ?wf type))
  (bson-append ?doc "is-list" (fact-slot-value ?wf is-list))
  (if (fact-slot-value ?wf is-list)
   then (bson-append-array ?doc "values" (fact-slot-value ?wf values))
   else (bson-append ?doc "value" (fact-slot-value ?wf value)))
  (return ?doc)
)

(deffunction wm-robmem-sync-create-query (?id ?update-timestamp)
  "A query for the document ?id, if its timestamp is at most ?update-timestamp. The caller
   destroys the query."
  (bind ?not-later (bson-create))
  (bson-append-time ?not-later "$lte" ?update-timestamp)
  (bind ?query (bson-create))
  (bson-append ?query "_id" ?id)
  (bson-append ?query "update-timestamp" ?not-later)
  (bson-destroy ?not-later)
  (return ?query)
)

(deffunction wm-robmem-sync-typed (?type ?value)
  "Internal. The value in the type of the wm-fact, because documents have no symbols."
  (if (or (eq ?type SYMBOL) (eq ?type BOOL)) then (return (sym-cat ?value)))
  (return ?value)
)

(deffunction wm-robmem-sync-doc-values (?doc ?prefix ?type)
  "Internal. The values of a document whose fields are below ?prefix."
  (bind ?values (create$))
  (progn$ (?value (bson-get-array ?doc (str-cat ?prefix "values")))
    (bind ?values (create$ ?values (wm-robmem-sync-typed ?type ?value)))
  )
  (return ?values)
)

(deffunction wm-robmem-sync-fits (?type ?value)
  "Internal. TRUE if ?value, as bson-get returns it, can be the value of a wm-fact of the type
   ?type. FALSE is a value of the type BOOL only, because bson-get returns FALSE for a missing
   field. Other values are not compared with the type. Destroys a document or list."
  ; an external address is a document or a list, which the receiver destroys; INVALID_VALUE_TYPE stands
  ; for a value that CLIPS cannot have
  (if (external-addressp ?value) then (bson-destroy ?value) (return FALSE))
  (return (and (neq ?value INVALID_VALUE_TYPE) (or (neq ?value FALSE) (eq ?type BOOL))))
)

(deffunction wm-robmem-sync-is-fact (?doc ?prefix)
  "Internal. TRUE if the document has valid content of a wm-fact in the fields below ?prefix."
  (bind ?type (bson-get ?doc (str-cat ?prefix "type")))
  (bind ?is-list (bson-get ?doc (str-cat ?prefix "is-list")))
  (if (not (and (wm-robmem-sync-fits SYMBOL ?type) (wm-robmem-sync-fits BOOL ?is-list)
                (member$ (sym-cat ?type) (deftemplate-slot-allowed-values wm-fact type))))
   then (return FALSE))
  (switch (sym-cat ?is-list)
    (case FALSE then
      (return (and (bson-has-field ?doc (str-cat ?prefix "value"))
                   (wm-robmem-sync-fits (sym-cat ?type)
                                        (bson-get ?doc (str-cat ?prefix "value"))))))
    (case TRUE then
      (bind ?is-fact (bson-has-field ?doc (str-cat ?prefix "values")))
      (progn$ (?value (bson-get-array ?doc (str-cat ?prefix "values")))
        (if (not (wm-robmem-sync-fits (sym-cat ?type) ?value)) then (bind ?is-fact FALSE)))
      (return ?is-fact))
  )
  (return FALSE)
)

(deffunction wm-robmem-sync-set-fact (?id ?key ?doc ?prefix)
  "Internal. Set the wm-fact ?id to the content of the document, whose fields are
   below ?prefix. Returns the fact."
  (bind ?type (sym-cat (bson-get ?doc (str-cat ?prefix "type"))))
  (bind ?is-list (sym-cat (bson-get ?doc (str-cat ?prefix "is-list"))))
  (bind ?value nil)
  (bind ?values (create$))
  (if (eq ?is-list TRUE)
   then (bind ?values (wm-robmem-sync-doc-values ?doc ?prefix ?type))
   else (bind ?value (wm-robmem-sync-typed ?type
                       (bson-get ?doc (str-cat ?prefix "value")))))
  (do-for-fact ((?wf wm-fact)) (eq ?id ?wf:id)
    (return (modify ?wf (type ?type) (is-list ?is-list) (value ?value) (values ?values)))
  )
  (return (assert (wm-fact (id ?id) (key ?key) (type ?type) (is-list ?is-list)
                           (value ?value) (values ?values))))
)

; *** Restore, flush ***

(deffunction wm-robmem-sync-restore-prefix (?id-prefix)
  "Assert or modify the wm-facts of the documents whose ID starts with ?id-prefix, a regular
   expression. Documents without the content of a wm-fact are reported and ignored."
  (bind ?query (bson-create))
  (bson-append-regex ?query "_id" (str-cat "^" ?id-prefix))
  (bind ?cursor (robmem-query ?*WM-ROBMEM-SYNC-COLLECTION* ?query))
  (bson-destroy ?query)
  (if (not ?cursor) then (return))
  (bind ?doc (robmem-cursor-next ?cursor))
  (while ?doc do
    (bind ?id (bson-get ?doc "_id"))
    (if (wm-robmem-sync-is-fact ?doc "")
     then (wm-robmem-sync-set-fact ?id (wm-id-to-key ?id) ?doc "")
     else (printout error "The document " ?id " is not a wm-fact, it is ignored" crlf))
    (bson-destroy ?doc)
    (bind ?doc (robmem-cursor-next ?cursor))
  )
  (robmem-cursor-destroy ?cursor)
)

(deffunction wm-robmem-sync-restore ()
  "Assert or modify the wm-facts of the documents with a shared prefix."
  (do-for-all-facts ((?conf wm-robmem-sync-conf)) (eq ?conf:enabled TRUE)
    (wm-robmem-sync-restore-prefix (wm-key-to-id ?conf:wm-fact-key-prefix))
  )
)

(deffunction wm-robmem-flush ()
  "Remove all documents of the collection."
  (bind ?everything (bson-create))  ; an empty query matches all documents
  (robmem-remove ?*WM-ROBMEM-SYNC-COLLECTION* ?everything)
  (bson-destroy ?everything)
)

; *** The trigger ***

(deffunction wm-robmem-trigger-register ()
  "Register the trigger for the collection; the reply is a feedback fact."
  (bind ?everything (bson-create))
  (robmem-trigger-register ?*WM-ROBMEM-SYNC-COLLECTION* ?everything
                           "wm-robmem-sync-trigger")
  (bson-destroy ?everything)
)

(defrule wm-robmem-sync-init
  (executive-init)
  (not (wm-robmem-sync-initialized))
  (not (executive-finalize))
  =>
  (wm-robmem-trigger-register)
  (if (not (any-factp ((?wf wm-fact)) (eq "/cx/identity" ?wf:id))) then
    (printout warn "*** /cx/identity is not set in world model, "
                   "will not sync until it is set! ***" crlf))
)

; The feedback of all triggers has "mutex" in its name, as in Fawkes.

(defrule wm-robmem-register-trigger-done
  ?answer <- (mutex-trigger-register-feedback SUCCESS "wm-robmem-sync-trigger" ?trigger)
  =>
  (printout info "Registered trigger 'wm-robmem-sync-trigger'" crlf)
  (assert (wm-robmem-sync-initialized (trigger-ptr ?trigger)))
  (retract ?answer)
)

(defrule wm-robmem-register-trigger-failed
  ?answer <- (mutex-trigger-register-feedback FAIL "wm-robmem-sync-trigger")
  =>
  (retract ?answer)
  (printout warn "Failed to register trigger 'wm-robmem-sync-trigger', retrying" crlf)
  (wm-robmem-trigger-register)
)

(defrule wm-robmem-sync-finalize
  ?state <- (wm-robmem-sync-initialized (trigger-ptr ?trigger))
  (executive-finalize)
  =>
  (retract ?state)
  (robmem-trigger-destroy ?trigger)
)

; *** From the world model to the robot memory ***

(deffunction wm-robmem-sync-fact-update (?wf ?identity ?update-timestamp)
  "Write the wm-fact to the robot memory."
  (bind ?id (fact-slot-value ?wf id))
  (bind ?doc (wm-robmem-sync-create-fact-doc ?wf ?identity ?update-timestamp))
  (bind ?query (wm-robmem-sync-create-query ?id ?update-timestamp))
  (robmem-upsert ?*WM-ROBMEM-SYNC-COLLECTION* ?doc ?query)
  (bson-destroy ?query)
  (bson-destroy ?doc)
)

(deffunction wm-robmem-sync-send (?wf ?identity)
  "Internal. Write the wm-fact with the present time, and store its state."
  (bind ?now (wm-robmem-sync-now))
  (wm-robmem-sync-note-content ?wf)
  (wm-robmem-sync-note-entry (fact-slot-value ?wf id) (fact-slot-value ?wf key)
                             (fact-index ?wf) ?now)
  (wm-robmem-sync-fact-update ?wf ?identity ?now)
)

(defrule wm-robmem-sync-fact-added
  "A new fact to share."
  (wm-fact (key cx identity) (value ?identity))
  ?wf <- (wm-fact (id ?id&~"") (key $?key))
  (not (wm-robmem-sync-map-entry (wm-fact-id ?id)))
  (wm-robmem-sync-conf (wm-fact-key-prefix $?prefix&:(wm-key-prefix ?key ?prefix))
                       (enabled TRUE))
  =>
  (wm-robmem-sync-send ?wf ?identity)
)

(defrule wm-robmem-sync-fact-modified
  "A shared fact has another index: it was modified, or asserted again."
  (wm-fact (key cx identity) (value ?identity))
  (wm-robmem-sync-map-entry (wm-fact-id ?id) (wm-fact-idx ?idx))
  ?wf <- (wm-fact (id ?id) (key $?key))
  (test (<> ?idx (fact-index ?wf)))
  (wm-robmem-sync-conf (wm-fact-key-prefix $?prefix&:(wm-key-prefix ?key ?prefix))
                       (enabled TRUE))
  =>
  (wm-robmem-sync-send ?wf ?identity)
)

(defrule wm-robmem-sync-fact-modified-in-place
  "A shared fact has the same index, but other content."
  (wm-fact (key cx identity) (value ?identity))
  (wm-robmem-sync-content (wm-fact-id ?id) (type ?type) (is-list ?is-list)
                          (value ?value) (values $?values))
  (wm-robmem-sync-map-entry (wm-fact-id ?id) (wm-fact-idx ?idx))
  ?wf <- (wm-fact (id ?id) (key $?key))
  (test (= ?idx (fact-index ?wf)))
  (not (wm-fact (id ?id) (type ?type) (is-list ?is-list)
                (value ?value) (values $?values)))
  (wm-robmem-sync-conf (wm-fact-key-prefix $?prefix&:(wm-key-prefix ?key ?prefix))
                       (enabled TRUE))
  =>
  (wm-robmem-sync-send ?wf ?identity)
)

(defrule wm-robmem-sync-fact-removed
  "A shared fact was retracted. The time of the change is the time of this rule."
  (wm-fact (key cx identity))
  ?entry <- (wm-robmem-sync-map-entry (wm-fact-id ?id) (wm-fact-idx ~0) (wm-fact-key $?key))
  (not (wm-fact (id ?id)))
  (wm-robmem-sync-conf (wm-fact-key-prefix $?prefix&:(wm-key-prefix ?key ?prefix))
                       (enabled TRUE))
  =>
  (bind ?now (wm-robmem-sync-now))
  (modify ?entry (update-timestamp ?now) (wm-fact-idx 0))
  (bind ?query (wm-robmem-sync-create-query ?id ?now))
  (robmem-remove ?*WM-ROBMEM-SYNC-COLLECTION* ?query)
  (bson-destroy ?query)
)

(defrule wm-robmem-sync-content-cleanup
  "LOW: the rules at salience 0 have handled the removal of the fact."
  (declare (salience ?*SALIENCE-LOW*))
  ?content <- (wm-robmem-sync-content (wm-fact-id ?id))
  (not (wm-fact (id ?id)))
  =>
  (retract ?content)
)

; *** From the robot memory to the world model ***

(deffunction wm-robmem-sync-time-of-entry (?id)
  "Internal. The last known time of a change of the fact; FALSE if there is none."
  (do-for-fact ((?entry wm-robmem-sync-map-entry)) (eq ?id ?entry:wm-fact-id)
    (return ?entry:update-timestamp)
  )
  (return FALSE)
)

(deffunction wm-robmem-sync-event-time (?obj)
  "Internal. The time of the change in the event ?obj."
  (if (bson-has-field ?obj "fullDocument.update-timestamp") then
    ; bson-get-time returns (FALSE) for a field that is not a time
    (bind ?time (bson-get-time ?obj "fullDocument.update-timestamp"))
    (if (and (= 2 (length$ ?time)) (integerp (nth$ 1 ?time))) then (return ?time)))
  (if (bson-has-field ?obj "wallTime") then
    ; not clusterTime, which has seconds only: a removal in the second of the last
    ; change would count as older
    (return (bson-get-time ?obj "wallTime")))
  (return (bson-get-time ?obj "clusterTime"))
)

(deffunction wm-robmem-sync-update (?obj)
  "Set the wm-fact to the document of an event, which another robot has written. If the fact
   and its time are known, a document that is not later is refused. As in Fawkes, the document
   is accepted even if this robot does not share facts with its prefix."
  (if (not (bson-has-field ?obj "fullDocument._id")) then (return))
  (bind ?id (bson-get ?obj "fullDocument._id"))
  (if (not (and (stringp ?id) (wm-robmem-sync-is-fact ?obj "fullDocument."))) then
    (printout error "The document " ?id " is not a wm-fact, it is ignored" crlf)
    (return))
  (bind ?time (wm-robmem-sync-event-time ?obj))
  (bind ?known-time (wm-robmem-sync-time-of-entry ?id))
  (bind ?have-fact (any-factp ((?wf wm-fact)) (eq ?id ?wf:id)))
  (bind ?knowledge (if ?have-fact
               then (if ?known-time then "known fact" else "no sync map entry, yet")
               else (if ?known-time then "no fact but sync map entry"
                               else "neither fact nor sync map entry")))
  (if (and ?have-fact ?known-time (not (time> ?time ?known-time))) then
    (printout warn "wm-robmem-sync-update: received update for " ?id
                   " with older data than our own" crlf)
    (return))
  (printout debug "wm-robmem-sync-update: updating (" ?knowledge ") " ?id crlf)
  (bind ?key (wm-id-to-key ?id))
  (do-for-fact ((?entry wm-robmem-sync-map-entry)) (eq ?id ?entry:wm-fact-id)
    (bind ?key ?entry:wm-fact-key)
  )
  (bind ?wf (wm-robmem-sync-set-fact ?id ?key ?obj "fullDocument."))
  (wm-robmem-sync-note-content ?wf)
  (wm-robmem-sync-note-entry ?id (fact-slot-value ?wf key) (fact-index ?wf) ?time)
)

(deffunction wm-robmem-sync-delete (?obj)
  "Handle the removal of a document by any robot, even this one: store the time of the removal, and
   retract the fact if this robot has sent or received it. A removal that is not later than the last
   known change is refused."
  (bind ?id (bson-get ?obj "documentKey._id"))
  (if (not (stringp ?id)) then (return))
  (bind ?time (wm-robmem-sync-event-time ?obj))
  (bind ?known-time (wm-robmem-sync-time-of-entry ?id))
  (if (and ?known-time (not (time> ?time ?known-time))) then
    ; "timetamp" is Fawkes' spelling
    (printout warn "wm-robmem-sync-delete: received delete for " ?id
                   " with older timetamp than our own" crlf)
    (return))
  (wm-robmem-sync-note-entry ?id (wm-id-to-key ?id) 0 ?time)
  (if ?known-time then
    (printout debug "wm-robmem-sync-delete: removing " ?id crlf)
    (do-for-fact ((?wf wm-fact)) (eq ?id ?wf:id) (retract ?wf)))
)

(deffunction wm-robmem-sync-written (?obj ?identity)
  "Internal. Handle a written document, unless this robot has written it."
  (if (not (bson-has-field ?obj "fullDocument.source")) then
    (printout error "Received update for " (bson-get ?obj "documentKey._id")
                    " with unknown source, update is lost! doc: "
                    (bson-tostring ?obj) crlf)
    (return))
  (if (neq (str-cat ?identity) (str-cat (bson-get ?obj "fullDocument.source"))) then
    (wm-robmem-sync-update ?obj))
)

(defrule wm-robmem-sync-fact-trigger-event
  "Handle the oldest event."
  (wm-fact (key cx identity) (value ?identity))
  ?event <- (robmem-trigger (name "wm-robmem-sync-trigger")
                            (rcvd-at $?time) (ptr ?obj))
  (not (robmem-trigger (name "wm-robmem-sync-trigger")
                       (rcvd-at $?other&:(time> ?time ?other))))
  =>
  (printout debug "Trigger: " (bson-tostring ?obj) crlf)
  (bind ?operation (sym-cat (bson-get ?obj "operationType")))
  (switch ?operation
    (case delete then (wm-robmem-sync-delete ?obj))
    (case insert then (wm-robmem-sync-written ?obj ?identity))
    (case update then (wm-robmem-sync-written ?obj ?identity))
    (default (printout error "Unknown operator " ?operation crlf))
  )
  (retract ?event)
  (bson-destroy ?obj)
)
