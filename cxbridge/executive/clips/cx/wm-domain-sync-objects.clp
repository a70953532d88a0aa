; Synchronises the domain-objects of each type and the wm-fact that lists them.
;
; A wm-sync-object marks each object that is or will be in the list, so that joins find
; the missing ones.
; Additions and removals are collected first, and the list is written once. A list that
; differs from the wm-sync-object-list was changed by a rule of the agent, and the
; domain-objects follow the list of the wm-fact.
;
; Each modify makes CLIPS join the fact with all its matches again. So the modified facts
; of this file are not joined with all objects of a type; the rules join these with
; wm-sync-listed-type.
;
; Needs wm-domain-sync.clp.

(deftemplate wm-sync-listed-type
  "Internal. A type that has a list."
  (slot type (type SYMBOL))
)

(deftemplate wm-sync-object-list
  "Internal. The list of a type at its last synchronisation."
  (slot type (type SYMBOL))
  (multislot names)
)

(deftemplate wm-sync-object
  "Internal. A domain-object that is or will be in the list of its type."
  (slot type (type SYMBOL))
  (slot name)
)

(deftemplate wm-sync-object-change
  "Internal. An object to add to the list of its type, or to remove."
  (slot type (type SYMBOL))
  (slot name)
  (slot operation (type SYMBOL) (allowed-values ADD REMOVE))
)

(deffunction wm-sync-map-object-type (?type ?key)
  "Internal. Map the objects of ?type to the wm-fact with the key ?key."
  (assert (wm-sync-listed-type (type ?type))
          (wm-sync-object-list (type ?type))
          (wm-sync-map-object-type (domain-object-type ?type) (wm-fact-key ?key)
                                   (wm-fact-id (wm-key-to-id ?key))))
)

(deffunction wm-sync-apply-object-changes (?type ?names)
  "Internal. The list ?names after all collected changes of ?type. Retracts the changes."
  (do-for-all-facts ((?change wm-sync-object-change)) (eq ?type ?change:type)
    (bind ?names (if (eq ?change:operation ADD)
                  then (create$ ?names ?change:name)
                  else (delete-member$ ?names ?change:name)))
  )
  (delayed-do-for-all-facts ((?change wm-sync-object-change)) (eq ?type ?change:type)
    (retract ?change)
  )
  (return ?names)
)

(defrule wm-sync-domain-object-type-added
  (declare (salience ?*SALIENCE-WM-SYNC-ADD*))
  (domain-object-type (name ?type))
  (not (wm-sync-remap-object-type (domain-object-type ?type)))
  (not (wm-sync-map-object-type (domain-object-type ?type)))
  =>
  (wm-sync-map-object-type ?type (create$ domain objects-by-type ?type))
)

(defrule wm-sync-domain-object-type-remapped-added
  "Fawkes' salience: a remapped type gets its list before the other types."
  (declare (salience ?*SALIENCE-WM-SYNC-DEL*))
  (domain-object-type (name ?type))
  (wm-sync-remap-object-type (domain-object-type ?type) (wm-fact-key $?key))
  (not (wm-sync-map-object-type (domain-object-type ?type)))
  =>
  (wm-sync-map-object-type ?type ?key)
)

(defrule wm-sync-domain-object-mapping-added
  "Assert an empty list for a type without list. If another rule has retracted the
   list, this counts as a change to the empty list."
  (declare (salience ?*SALIENCE-WM-SYNC-ADD*))
  ?map <- (wm-sync-map-object-type (wm-fact-id ?id) (wm-fact-key $?key) (wm-fact-idx ?idx))
  (not (wm-fact (id ?id)))
  =>
  (bind ?wf (assert (wm-fact (id ?id) (key ?key) (type SYMBOL) (is-list TRUE))))
  (modify ?map (wm-fact-idx (fact-index ?wf)))
)

(defrule wm-sync-domain-object-added
  "A domain-object is missing from its list."
  (declare (salience ?*SALIENCE-WM-SYNC-ADD*))
  (wm-sync-listed-type (type ?type))
  (domain-object (name ?name) (type ?type))
  (not (wm-sync-object (type ?type) (name ?name)))
  =>
  (assert (wm-sync-object (type ?type) (name ?name))
          (wm-sync-object-change (type ?type) (name ?name) (operation ADD)))
)

(defrule wm-sync-domain-object-removed
  "A domain-object of the list was retracted."
  (declare (salience ?*SALIENCE-WM-SYNC-DEL*))
  ?object <- (wm-sync-object (type ?type) (name ?name))
  (not (domain-object (name ?name) (type ?type)))
  (not (wm-sync-object-change (type ?type) (name ?name) (operation ADD)))
  =>
  (retract ?object)
  (assert (wm-sync-object-change (type ?type) (name ?name) (operation REMOVE)))
)

(defrule wm-sync-domain-object-not-added
  "A domain-object was retracted before its addition to the list."
  (declare (salience ?*SALIENCE-WM-SYNC-DEL*))
  ?object <- (wm-sync-object (type ?type) (name ?name))
  (not (domain-object (name ?name) (type ?type)))
  ?change <- (wm-sync-object-change (type ?type) (name ?name) (operation ADD))
  =>
  (retract ?object ?change)
)

(defrule wm-sync-domain-objects-listed
  "Write the list after all changes are collected."
  (declare (salience (- ?*SALIENCE-WM-SYNC-ADD* 1)))
  (wm-sync-listed-type (type ?type))
  (exists (wm-sync-object-change (type ?type)))
  ?list <- (wm-sync-object-list (type ?type) (names $?names))
  ?map <- (wm-sync-map-object-type (domain-object-type ?type) (wm-fact-id ?id))
  ?wf <- (wm-fact (id ?id) (type SYMBOL) (is-list TRUE))
  =>
  (bind ?names (wm-sync-apply-object-changes ?type ?names))
  (bind ?wf (modify ?wf (values ?names)))
  (modify ?list (names ?names))
  (modify ?map (wm-fact-idx (fact-index ?wf)))
)

(defrule wm-sync-worldmodel-objects-changed
  "Another rule has changed the list: make the domain-objects those of the list,
   regardless of their own changes."
  (declare (salience ?*SALIENCE-WM-SYNC-DEL*))
  ?map <- (wm-sync-map-object-type (domain-object-type ?type) (wm-fact-id ?id))
  ?list <- (wm-sync-object-list (type ?type) (names $?before))
  ?wf <- (wm-fact (id ?id) (type SYMBOL) (is-list TRUE) (values $?names&~$?before))
  =>
  (wm-sync-apply-object-changes ?type ?before)  ; only to retract the changes
  (delayed-do-for-all-facts ((?object domain-object))
      (and (eq ?type ?object:type) (not (member$ ?object:name ?names)))
    (retract ?object)
  )
  (delayed-do-for-all-facts ((?listed wm-sync-object))
      (and (eq ?type ?listed:type) (not (member$ ?listed:name ?names)))
    (retract ?listed)
  )
  (progn$ (?name ?names)
    (assert (domain-object (name ?name) (type ?type))
            (wm-sync-object (type ?type) (name ?name)))
  )
  (modify ?list (names ?names))
  (modify ?map (wm-fact-idx (fact-index ?wf)))
)
